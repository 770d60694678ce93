"""Error of the gap between straight edges against the Cramer-Rao bound, beside other methods on the same frames.

    python -m tests.benchmarks.peers [--frames 60] [--seed 3]

RMS about the truth in px. find_contours and the derivative are given so many rows below the measuring height and the
mean of their answers is taken; on round tips they are given the two rows beside it and interpolate. The paper counts
pixels in the one row. `fingervision` takes the rows it finds, so beside few rows it may lie below their bound.
"""

from math import pi, sqrt

import cv2
import numpy as np
from skimage.measure import find_contours

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame, Pixels
from fingervision.domain.gap import GapMeasurement
from fingervision.rendering import Camera, TrueGap, render, truth, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame
from tests.benchmarks.frame import Namespace, benchmark

BELOW_PX = 10.2
CONTRAST, WINDOW_PX = 160.0, 20.0


def bound(blur: float, noise: float, rows: int) -> float:
    """Cramer-Rao bound of the gap: two edges, levels and blur unknown, 8-bit rounding counted as noise."""
    sigma = sqrt(blur**2 + 1 / 12)
    variance = (noise**2 + 1 / 12) / CONTRAST**2 / (rows * (1 / (2 * sqrt(pi) * sigma) - 1 / WINDOW_PX))
    return sqrt(2 * variance)


def otsu_and_count(pixels: Pixels, height: float, _rows: int) -> float:
    """The paper: black and white, then the light pixels between the fingers in the measuring row."""
    _, light = cv2.threshold(pixels, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    change = np.flatnonzero(np.diff(light[round(height)].astype(int)))
    middle = pixels.shape[1] / 2
    return float(change[change >= middle][0] - change[change < middle][-1])


def half_level(pixels: Pixels, height: float, rows: int) -> float:
    """scikit-image's contour at half level."""
    top = int(height)
    inside = pixels[top : top + rows + 1]
    threshold, _ = cv2.threshold(pixels, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    level = 0.5 * float(np.median(inside[inside > threshold]) + np.median(inside[inside <= threshold]))
    part = pixels[top : top + rows + 1].astype(float)
    widths, at = [], []
    points = np.concatenate(find_contours(part, level))
    for row in range(rows):
        x = points[np.abs(points[:, 0] - row) < 1e-9, 1]
        middle = pixels.shape[1] / 2
        widths.append(x[x >= middle].min() - x[x < middle].max())
        at.append(top + row - height)
    return _at_height(np.array(at), np.array(widths))


def derivative_parabola(pixels: Pixels, height: float, rows: int) -> float:
    """Derivative of a Gaussian of 1 px in every row, and a parabola through its peak."""
    top, middle = int(height), pixels.shape[1] // 2
    smooth = cv2.GaussianBlur(pixels[top : top + rows].astype(np.float64), (9, 1), 1.0)
    slope = np.gradient(smooth, axis=1)
    slope[:, :3] = slope[:, -3:] = 0.0

    def peak(row: np.ndarray, k: int) -> float:
        a, b, c = row[k - 1 : k + 2]
        return k + 0.5 * (a - c) / (a - 2 * b + c)

    # The inner edges rise to the gap on the left and fall on the right.
    widths = [
        peak(-row, middle + int(np.argmin(row[middle:]))) - peak(row, int(np.argmax(row[:middle]))) for row in slope
    ]
    return _at_height(np.arange(top, top + rows) - height, np.array(widths))


def _at_height(at: np.ndarray, widths: np.ndarray) -> float:
    return float(np.interp(0.0, at, widths)) if len(at) == 2 else float(np.mean(widths))


PEERS = (otsu_and_count, half_level, derivative_parabola)


def rms(blur: float, noise: float, rows: int, radius: float, frames: int, seed: int) -> list[float]:
    """RMS error of fingervision and of every peer."""
    rng = np.random.default_rng([seed, round(10 * blur), round(10 * noise), rows, round(radius)])
    camera = Camera(blur_px=blur, noise_grey=noise)
    errors = []
    for number in range(frames):
        scene = two_fingers(rng.uniform(60, 200), radius_px=radius, centre_px=rng.uniform(-3, 3), tip_at_px=120.4)
        true = truth(scene, camera, BELOW_PX)
        assert isinstance(true, TrueGap)
        pixels = render(scene, camera, rng)
        found = measure_frame(Frame(pixels, number), Settings(BELOW_PX, Direction.UP))
        own = found.gap_px if isinstance(found, GapMeasurement) else np.inf
        errors.append([g - true.gap_px for g in (own, *(peer(pixels, true.left.y_px, rows) for peer in PEERS))])
    return [float(e) for e in np.sqrt(np.mean(np.square(errors), axis=0))]


@benchmark(frames=60, seed=3)
def main(options: Namespace) -> None:
    """Print the table."""
    print("blur noise rows radius    bound  fingervision  Otsu+count  find_contours  derivative+parabola")
    for blur, noise, rows, radius in (
        (0.9, 2.0, 20, 0.0), (0.9, 2.0, 1, 0.0), (0.9, 2.0, 60, 0.0), (0.5, 2.0, 20, 0.0), (2.0, 2.0, 20, 0.0),
        (3.0, 2.0, 20, 0.0), (0.9, 0.5, 20, 0.0), (0.9, 6.0, 20, 0.0), (0.9, 10.0, 20, 0.0),
        (0.9, 2.0, 2, 17.0), (0.9, 2.0, 2, 30.0), (3.0, 2.0, 2, 30.0),
    ):  # fmt: skip
        own, otsu, contour, parabola = rms(blur, noise, rows, radius, options.frames, options.seed)
        limit = f"{bound(blur, noise, rows):8.4f}" if radius == 0.0 else "       -"
        scene = f"{blur:4.1f} {noise:5.1f} {rows:4d} {radius:6.0f}"
        print(f"{scene} {limit} {own:13.4f} {otsu:11.4f} {contour:14.4f} {parabola:20.4f}")

"""One bench: a camera that may be turned or tilted, its light, its shutter; and the pictures that it takes."""

from dataclasses import dataclass
from math import cos, radians, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.camera_artefacts.scene import Finger, true_gap

Floats = NDArray[np.float64]
SAMPLES = 3
SIZE_PX = (400, 256)
PX_PER_MM = 34.0
BELOW_MM = 0.3
DISTANCE_MM = 100.0


@dataclass(frozen=True)
class Bench:
    """A set-up; levels are shares of full scale in linear light.

    Parameters
    ----------
    gap_px, width_px, radius_px, spread_deg : float
        The gripper as a camera of 34 px/mm that looks squarely sees it.
    step_px : float
        By how much the gap opens from frame to frame.
    zoom : float
        Scale of the picture over 34 px/mm.
    ground, finger, noise : float
        Light of the two, and the sensor's noise.
    texture : float
        Standard deviation of the ground's own pattern, as a share of its light.
    bright_px, bright : float
        Light that is strongest in the middle of the gap: its half-breadth and its extra share.
    blur_px : float
        Gaussian sigma of the optics.
    motion_px : float
        Way of each finger while the shutter is open.
    turn_deg, tilt_deg : float
        Of the camera about its own axis, and about the fingers' direction.
    shake_px : float
        Standard deviation of the camera's place from frame to frame, in the picture.
    gamma : float
        The camera's transfer curve is a power of 1 / gamma.
    jpeg : int or None
        Quality at which pictures are stored.
    """

    gap_px: float = 80.0
    width_px: float = 90.0
    radius_px: float = 12.0
    spread_deg: float = 0.0
    step_px: float = 0.0
    zoom: float = 1.0
    ground: float = 0.75
    finger: float = 0.12
    noise: float = 2.0 / 255.0
    texture: float = 0.0
    bright_px: float = 60.0
    bright: float = 0.0
    blur_px: float = 1.0
    motion_px: float = 0.0
    turn_deg: float = 0.0
    tilt_deg: float = 0.0
    shake_px: float = 0.0
    gamma: float = 1.0
    jpeg: int | None = None

    def fingers(self, frame: int) -> tuple[Finger, Finger]:
        """Both fingers of a frame, in the pixels of 34 px/mm, origin at the picture's middle."""
        apart = 0.5 * (self.gap_px + self.step_px * frame + self.width_px)
        left, right = (Finger(s * apart, -20.0, self.width_px, self.radius_px, s * self.spread_deg) for s in (-1, 1))
        return left, right

    def gap_mm(self, frame: int) -> float:
        """True gap."""
        return true_gap(*self.fingers(frame), BELOW_MM * PX_PER_MM) / PX_PER_MM


@dataclass(frozen=True)
class Recording:
    """Pictures (as stored), their true gaps (mm), and whether they are JPEG."""

    pictures: tuple[NDArray[np.uint8] | bytes, ...]
    gaps_mm: tuple[float, ...]
    is_jpeg: bool


def recorded(bench: Bench, frames: int, rng: np.random.Generator) -> Recording:
    """Take pictures."""
    ground = _pattern(rng) if bench.texture else None
    offset = rng.uniform(-0.5, 0.5, 2)
    pictures = []
    for frame in range(frames):
        shift = offset + bench.shake_px * rng.standard_normal(2) * (frame > 0)
        light = _light(bench, bench.fingers(frame), shift, ground) + bench.noise * rng.standard_normal(SIZE_PX[::-1])
        stored = np.clip(np.rint(255.0 * np.clip(light, 0.0, 1.0) ** (1.0 / bench.gamma)), 0, 255).astype(np.uint8)
        pictures.append(stored if bench.jpeg is None else _jpeg(stored, bench.jpeg))
    return Recording(tuple(pictures), tuple(bench.gap_mm(k) for k in range(frames)), bench.jpeg is not None)


def _light(bench: Bench, fingers: tuple[Finger, Finger], shift: Floats, ground: Floats | None) -> Floats:
    width, height = SIZE_PX
    x = ((np.arange(width * SAMPLES) + 0.5) / SAMPLES - 0.5 * width - shift[0]).astype(np.float32)[None, :]
    y = ((np.arange(height * SAMPLES) + 0.5) / SAMPLES - 0.5 * height - shift[1]).astype(np.float32)[:, None]
    # From the picture to the plane of the fingers: turn, then perspective, then scale.
    c, s = cos(radians(bench.turn_deg)), sin(radians(bench.turn_deg))
    u, v = c * x + s * y, c * y - s * x
    far = DISTANCE_MM * PX_PER_MM * bench.zoom
    c, s = cos(radians(bench.tilt_deg)), sin(radians(bench.tilt_deg))
    plane_x = far * u / (far * c - u * s)
    plane_y = v * (far + plane_x * s) / far
    plane_x, plane_y = plane_x / bench.zoom, plane_y / bench.zoom
    light = np.full((y.size, x.size), bench.ground, dtype=np.float32)
    if bench.bright:
        light *= 1.0 + bench.bright * np.exp(-0.5 * (plane_x / bench.bright_px) ** 2)
    if ground is not None:
        light *= 1.0 + bench.texture * cv2.remap(
            ground.astype(np.float32),
            (SAMPLES * (plane_x + 0.75 * width)).astype(np.float32),
            (SAMPLES * (plane_y + 0.75 * height)).astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REFLECT,
        )
    for finger in fingers:
        covered = np.clip(0.5 - finger.distance(plane_x, plane_y) * (SAMPLES * bench.zoom), 0.0, 1.0)
        wide = round(bench.motion_px * SAMPLES)
        covered = cv2.blur(covered, (wide | 1, 1)) if wide > 1 else covered
        light += covered * (bench.finger - light)
    spread = cv2.GaussianBlur(light, (0, 0), bench.blur_px * SAMPLES, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(spread.reshape(height, SAMPLES, width, SAMPLES).mean(axis=(1, 3), dtype=np.float64))


def _pattern(rng: np.random.Generator) -> Floats:
    """A ground with detail of a few pixels."""
    shape = (int(1.5 * SIZE_PX[1] * SAMPLES), int(1.5 * SIZE_PX[0] * SAMPLES))
    fine = cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), 3.0 * SAMPLES)
    return np.asarray(fine / fine.std())


def _jpeg(picture: NDArray[np.uint8], quality: int) -> bytes:
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()

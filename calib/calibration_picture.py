"""The calibration picture: the reference object with the fitted edges, and their residuals magnified."""

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.line_scale import ScaleLines
from calib.parallel_edges import ParallelEdges

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

GREEN, ORANGE, BLUE, WHITE = (60, 220, 60), (255, 150, 0), (90, 170, 255), (255, 255, 255)
# OpenCV draws sub-pixel points as multiples of 1/16 px.
SHIFT = 4
# Approximate length with which the largest residual is drawn (pixels of the picture).
DRAWN_PX = 14.0
MAGNIFICATIONS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)
# Small pictures are enlarged so that lines and words can be read.
LEAST_SIDE_PX = 900


def picture_of_edges(grey: NDArray[np.uint8] | NDArray[np.uint16], edges: ParallelEdges, words: str) -> Picture:
    """Draw the two edges, the rows used, the width and the residuals into a picture.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        The picture in red, green and blue.
    """
    canvas, zoom = _canvas(grey)
    largest = max(float(np.percentile(np.abs(residual), 95)) for residual in edges.residuals_px)
    times = _magnification(largest)
    across = (edges.points_px[1] - edges.points_px[0]) / edges.width_px
    for points, residual in zip(edges.edges_px, edges.residuals_px, strict=True):
        line = points - residual[:, None] * across
        _polyline(canvas, _zoomed(line[[0, -1]], zoom), GREEN)
        _polyline(canvas, _zoomed(line + times * residual[:, None] * across, zoom), ORANGE)
    cv2.arrowedLine(
        canvas,
        _at(_zoomed(edges.points_px[0], zoom)),
        _at(_zoomed(edges.points_px[1], zoom)),
        BLUE,
        1,
        cv2.LINE_AA,
        SHIFT,
        0.03,
    )
    cv2.arrowedLine(
        canvas,
        _at(_zoomed(edges.points_px[1], zoom)),
        _at(_zoomed(edges.points_px[0], zoom)),
        BLUE,
        1,
        cv2.LINE_AA,
        SHIFT,
        0.03,
    )
    return _signed(canvas, f"{words}   green: edges   orange: residuals x {times}")


def picture_of_lines(
    grey: NDArray[np.uint8] | NDArray[np.uint16],
    lines: ScaleLines,
    used: NDArray[np.bool_],
    residual_um: Floats,
    words: str,
) -> Picture:
    """Draw the centre of every line of a line scale, and its magnified deviation from the nominal position.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        The picture.
    lines : ScaleLines
        Lines found in the picture.
    used : ndarray of bool, shape (n,)
        Whether each line was used; used lines are drawn in green, the others in orange.
    residual_um : ndarray, shape (n,)
        Residual of each line's position after the fit of the scale.
    words : str
        Text at the top of the picture.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        The picture in red, green and blue.
    """
    canvas, zoom = _canvas(grey)
    along = np.array([-lines.across[1], lines.across[0]])
    half = 0.5 * (lines.rows[1] - lines.rows[0])
    times = DRAWN_PX / max(float(np.max(np.abs(residual_um[used]))), 1e-9)
    for middle, is_used in zip(lines.middle_px, used, strict=True):
        ends = np.stack([middle - half * along, middle + half * along])
        _polyline(canvas, _zoomed(ends, zoom), GREEN if is_used else ORANGE)
    off = lines.middle_px[used] + (times * residual_um[used])[:, None] * along
    _polyline(canvas, _zoomed(lines.middle_px[used], zoom), WHITE)
    _polyline(canvas, _zoomed(off, zoom), BLUE)
    return _signed(canvas, f"{words}   blue: residuals, {1.0 / times:.2g} um a pixel")


def picture_of_corners(
    grey: NDArray[np.uint8] | NDArray[np.uint16], corners_px: Floats, residual_px: Floats, words: str
) -> Picture:
    """Draw the corners of a board and their residuals; arrays of shape (n, 2)."""
    canvas, zoom = _canvas(grey)
    times = _magnification(float(np.percentile(np.linalg.norm(residual_px, axis=1), 95)))
    for corner, residual in zip(corners_px, residual_px, strict=True):
        cv2.circle(canvas, _at(_zoomed(corner, zoom)), round(3 * 2**SHIFT), GREEN, 1, cv2.LINE_AA, SHIFT)
        cv2.line(
            canvas,
            _at(_zoomed(corner, zoom)),
            _at(_zoomed(corner + times * residual, zoom)),
            ORANGE,
            1,
            cv2.LINE_AA,
            SHIFT,
        )
    return _signed(canvas, f"{words}   green: corners   orange: residuals x {times}")


def _canvas(grey: NDArray[np.uint8] | NDArray[np.uint16]) -> tuple[Picture, int]:
    eight_bit = grey if grey.dtype == np.uint8 else (grey // 257).astype(np.uint8)
    zoom = max(1, -(-LEAST_SIDE_PX // max(grey.shape)))
    large = np.repeat(np.repeat(eight_bit, zoom, axis=0), zoom, axis=1)
    return np.ascontiguousarray(np.stack([large] * 3, axis=2)), zoom


def _zoomed(points: Floats, zoom: int) -> Floats:
    # The centre of the first pixel is (0, 0) in the original and in the enlarged picture.
    return np.asarray((points + 0.5) * zoom - 0.5)


def _magnification(largest_px: float) -> int:
    fitting = [times for times in MAGNIFICATIONS if times * largest_px <= DRAWN_PX]
    return fitting[-1] if fitting else 1


def _at(point: Floats) -> tuple[int, int]:
    return round(float(point[0]) * 2**SHIFT), round(float(point[1]) * 2**SHIFT)


def _polyline(canvas: Picture, points: Floats, colour: tuple[int, int, int]) -> None:
    fixed = np.rint(points * 2**SHIFT).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(canvas, [fixed], False, colour, 1, cv2.LINE_AA, SHIFT)


def _signed(canvas: Picture, words: str) -> Picture:
    scale = 0.5
    (width, height), below = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    scale *= min(1.0, (canvas.shape[1] - 16) / width)
    strip = np.zeros((height + below + 12, canvas.shape[1], 3), dtype=np.uint8)
    cv2.putText(strip, words, (8, height + 6), cv2.FONT_HERSHEY_SIMPLEX, scale, WHITE, 1, cv2.LINE_AA)
    return np.concatenate([canvas, strip], axis=0)

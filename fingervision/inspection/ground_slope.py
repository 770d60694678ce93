"""Slope of the background's light towards each inner edge, from the whole half of the gap beside it.

The window of an edge's fit is only a few pixels long. Over such a length the slope of uneven light is hardly larger
than that of a pattern on the background; over half of the gap the pattern averages out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.inspection.look import Look
from fingervision.vision.edge_filters import blurred_step
from fingervision.vision.profile_lines import INNER
from fingervision.vision.response_shift import PHASES_PX, mean_shift_px

Floats = NDArray[np.float64]

# Distance of the nearest pixels from the edge, as a multiple of its blur, and farthest distance (pixels).
BEYOND_BLURS, FARTHEST_PX = 3.0, 40.0
# Smallest number of pixels across and of rows from which a slope is computed.
FEWEST_ACROSS, FEWEST_ROWS = 8, 6
# Number of parts of a flank whose slopes are compared: a pattern on the background differs from part to part.
PARTS = 4
# Slope (share of the contrast per pixel) by which the shift of a fitted edge is computed.
SMALL_SLOPE = 0.005


@dataclass(frozen=True, slots=True)
class GroundSlope:
    """Slope of the background beside one inner edge.

    Parameters
    ----------
    moves_px : float
        Outward shift of the edge's fit by a background that slopes like this (pixels).
    u_px : float
        Standard uncertainty of the shift, from the differences between parts of the flank (pixels).
    """

    moves_px: float
    u_px: float


def ground_slope(looks: Sequence[Look], side: int, light: Floats) -> GroundSlope | None:
    """Slope of the background beside the left (0) or right (1) inner edge; None if too little background is in view.

    Parameters
    ----------
    looks : sequence of Look
        Frames inspected in detail.
    side : int
        0 for the left finger, 1 for the right finger.
    light : ndarray of float, shape (levels,)
        Light for every grey level (look-up table), increasing.
    """
    found = [parts for look in looks if (parts := _slopes(look, side, light)) is not None]
    if not found:
        return None
    # The pattern hardly moves from frame to frame, so that more frames do not average it.
    parts = np.mean(found, axis=0)
    blur_px = float(np.median([look.edges.blur_px[side, 0] for look in looks]))
    gain = _shift_per_slope_px2(blur_px, int(np.median([look.edges.reach_px for look in looks])))
    return GroundSlope(gain * float(parts.mean()), abs(gain) * float(parts.std(ddof=1)) / np.sqrt(PARTS))


def _slopes(look: Look, side: int, light: Floats) -> Floats | None:
    """Slope of the light away from the edge, in parts of the flank, as shares of the contrast per pixel."""
    edges = look.edges
    real = np.flatnonzero(edges.lines.weight[side, :INNER] > 0)
    rows = real[real.size // 2 :]
    other = edges.position[1 - side, :INNER][edges.lines.weight[1 - side, :INNER] > 0]
    if rows.size < FEWEST_ROWS or not other.size:
        return None
    fixed, found = edges.lines.fixed[side, rows].astype(float), edges.position[side, rows]
    slope, at = np.polyfit(fixed, found, 1)
    half_px = min(0.5 * float(np.min(np.abs(other - np.median(found)))), FARTHEST_PX)
    away = np.arange(int(np.ceil(BEYOND_BLURS * look.flank_blur_px)) + 1, int(half_px) + 1)
    every = np.arange(int(fixed.min()), int(fixed.max()) + 1)
    columns = np.rint(at + slope * every).astype(int)[:, None] + int(edges.lines.outward[side, rows[0]]) * away
    if away.size < FEWEST_ACROSS or columns.min() < 0 or columns.max() >= look.upright.shape[1]:
        return None
    centred = away - away.mean()
    by_row = light[look.upright[every[:, None], columns]] @ centred / (centred @ centred)
    return np.array([part.mean() for part in np.array_split(by_row, PARTS)]) / max(look.contrast, 1e-9)


def _shift_per_slope_px2(blur_px: float, reach_px: int) -> float:
    """Shift of a fitted step (px) per slope of the outer plateau (share of the contrast per px)."""
    borders = np.arange(-reach_px - 0.5, reach_px + 1.0) - PHASES_PX[:, None]
    step, _, _ = blurred_step(borders, np.full((PHASES_PX.size, 1), blur_px))
    away = 0.5 * (borders[:, 1:] + borders[:, :-1])
    return mean_shift_px(step + SMALL_SLOPE * np.maximum(away, 0.0), reach_px, blur_px) / SMALL_SLOPE

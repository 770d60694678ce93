"""Mean profile of light across each inner flank, from all frames with their different sub-pixel phases."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.profile_lines import INNER

Floats = NDArray[np.float64]

# Width of a bin across the edge (pixels), smallest number of pixels in a bin, and smallest number of bins of a profile.
BIN_PX, FEWEST_IN_BIN, FEWEST_BINS = 0.25, 6, 12
# Extent of the profile to either side: this multiple of the blur plus these pixels, at most the last number of pixels.
REACH_BLURS, REACH_EXTRA_PX, FARTHEST_PX = 4.0, 3.0, 20.0
# Largest scatter of the rows about a straight line (pixels) in the half of a flank that is farther from the tip.
STRAIGHT_PX, FEWEST_ROWS = 0.4, 6


@dataclass(frozen=True, slots=True, eq=False)
class FlankProfile:
    """Mean levels across one flank; arrays of shape (n,).

    Parameters
    ----------
    away_px : ndarray of float
        Distance outwards from the fitted edge, perpendicular to it.
    level : ndarray of float
        Mean light at this distance, on the scale of the levels.
    u_level : ndarray of float
        Standard uncertainty of the mean, from the scatter within the bin.
    pixel_px : float
        Width of a pixel, measured across the edge.
    """

    away_px: Floats
    level: Floats
    u_level: Floats
    pixel_px: float


def flank_profile(seen: Sequence[tuple[GreyImage, EdgePoints]], side: int, light: Floats) -> FlankProfile | None:
    """Mean profile of the left (0) or right (1) inner flank; None if it is too short, bent, or out of view.

    Parameters
    ----------
    seen : sequence of (ndarray, EdgePoints)
        Pictures turned so that the tips point up, and the edges fitted in them.
    side : int
        0 for the left finger, 1 for the right finger.
    light : ndarray of float, shape (levels,)
        Light for every grey level (look-up table), increasing.
    """
    away, levels, pixel = [], [], 1.0
    for upright, edges in seen:
        found = _one(upright, edges, side)
        if found is not None:
            away.append(found[0])
            levels.append(found[1])
            pixel = found[2]
    if not away:
        return None
    t, stored = np.concatenate(away), np.concatenate(levels)
    value = stored.astype(np.float64)
    place = np.floor((t - t.min()) / BIN_PX).astype(int)
    count = np.bincount(place)
    full = count >= FEWEST_IN_BIN
    if np.count_nonzero(full) < FEWEST_BINS:
        return None
    n = np.maximum(count, 1)
    middle, mean = np.bincount(place, t) / n, np.bincount(place, value) / n
    # The scatter is computed about a line through each bin, so that the slope of the edge is not counted as noise.
    dt = t - middle[place]
    slope = np.bincount(place, dt * value) / np.maximum(np.bincount(place, dt * dt), 1e-9)
    left = value - mean[place] - slope[place] * dt
    variance = np.bincount(place, left**2) / np.maximum(count - 2, 1)
    usual = float(np.median(variance[full]))
    u_level = np.sqrt(np.maximum(variance[full], usual) / count[full])
    # The noise of the stored levels is multiplied by the slope of the response curve, so that different responses are
    # compared with the same noise.
    gain = np.interp(mean[full], np.arange(light.size), np.gradient(light))
    in_light = np.bincount(place, light[stored])[full] / count[full]
    return FlankProfile(middle[full], in_light, np.maximum(u_level * gain, 1e-6), pixel)


def _one(upright: GreyImage, edges: EdgePoints, side: int) -> tuple[Floats, GreyImage, float] | None:
    """Distances from the edge, stored levels, and width of a pixel across the edge, for one picture."""
    real = np.flatnonzero(edges.lines.weight[side, :INNER] > 0)
    rows = real[real.size // 2 :]
    if rows.size < FEWEST_ROWS:
        return None
    fixed, found = edges.lines.fixed[side, rows].astype(float), edges.position[side, rows]
    slope, at = np.polyfit(fixed, found, 1)
    scatter = found - at - slope * fixed
    if 1.4826 * float(np.median(np.abs(scatter))) > STRAIGHT_PX:
        return None
    blur = float(edges.blur_px[side, 0])
    other = edges.position[1 - side, :INNER][edges.lines.weight[1 - side, :INNER] > 0]
    apart = float(np.min(np.abs(other - np.median(found)))) if other.size else FARTHEST_PX
    reach = int(min(REACH_BLURS * blur + REACH_EXTRA_PX, FARTHEST_PX))
    outside = int(min(reach, 0.5 * apart))
    every = np.arange(int(fixed.min()), int(fixed.max()) + 1)
    line = at + slope * every
    outward = int(edges.lines.outward[side, rows[0]])
    columns = np.rint(line).astype(int)[:, None] + outward * np.arange(-reach, outside + 1)
    inside = (columns >= 0) & (columns < upright.shape[1])
    levels = upright[np.broadcast_to(every[:, None], columns.shape)[inside], columns[inside]]
    cosine = float(1.0 / np.hypot(1.0, slope))
    return (outward * (columns - line[:, None]) * cosine)[inside], levels, cosine

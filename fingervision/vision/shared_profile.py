"""Mean residual over all rows of a flank: how far something may have displaced the flank as a whole.

Where a codec, an interpolation or a filter affects all rows in the same way, their mean residual does not average out.
Across the edge, one component of the mean residual is absorbed by the fit as a displacement and cannot be seen; the
other components are visible, and the first is assumed to be about as large as they are. A displacement leaves a profile
that is even about the edge. Optics that spread light equally to both sides leave an odd profile only, whatever their
shape.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import blurred_step, edge_filters
from fingervision.vision.edges import EdgePoints
from fingervision.vision.facing import facing_lines
from fingervision.vision.grey import GreyImage
from fingervision.vision.line_levels import line_levels
from fingervision.vision.profile_lines import INNER, ROWS

Floats = NDArray[np.float64]

FLANKS = (slice(0, INNER), slice(INNER, ROWS))
# A flank has so many rows, which lean by less than this (change of the edge from row to row).
FEWEST_ROWS, STEEPEST = 8, 0.3
# Of a window's pixels so many are taken up by level, contrast, position and (shared by all rows) blur.
FITTED, FITTED_BY_ROW = 4, 3
# Even profiles: variance of the mean over that of rows with noise of their own, beyond which it is no chance. In 99.9 %
# of pictures without anything shared the mean over four flanks of four even profiles each is below this (chi-square of
# 16), and the whole profile's below the first.
LEAST_WHOLE, LEAST_EVEN = 1.5, 2.45
# Profiles that the fit takes up but for this share of their power say nothing.
LEAST_OWN = 1e-3

_mean = loop("shared_profile_mean")


class Flank(NamedTuple):
    """Mean residual of one flank's rows.

    Parameters
    ----------
    mean : ndarray of float, shape (pixels,)
        From inside to outside.
    chance : float
        Variance that each pixel's mean would have if every row erred by itself.
    offset_px : float
        Of the edge from the window's middle, on average.
    sigma_px : float
        Its blur.
    gain : float
        Change of the levels with the position, in root of the sum over the window: contrast times the filters' gain.
    """

    mean: Floats
    chance: float
    offset_px: float
    sigma_px: float
    gain: float


def flanks(upright: GreyImage, edges: EdgePoints, light: Floats) -> list[Flank]:
    """Mean residuals of all flanks that are long and upright enough; none where the fingers' windows overlap.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels, seen with the tips up.
    edges : EdgePoints
        Fitted to them.
    light : ndarray of float, shape (levels,)
        Light of every grey level.
    """
    if facing_lines(edges.lines, edges.reach_px) is not None:
        return []
    levels = line_levels(upright, edges.lines, light, edges.reach_px)
    offset = (edges.position - edges.lines.coarse) * edges.lines.outward
    filters, pixels = edge_filters(edges.reach_px), levels.shape[-1]
    found = []
    for k in range(2):
        sigma = float(edges.blur_px[k, 0])
        for part in FLANKS:
            mean = np.empty(pixels)
            seen = (levels, offset, edges.contrast, edges.lines.weight, edges.lines.slope)
            rows, square, place, contrast = _mean(*(a[k, part] for a in seen), sigma, mean)
            if rows < FEWEST_ROWS or square <= 0.0:
                continue
            chance = square * pixels / ((pixels - FITTED_BY_ROW) * rows)
            gain = abs(contrast) * float(filters.shift_gain[filters.middle(sigma)])
            found.append(Flank(mean, chance, place, sigma, max(gain, 1e-9)))
    return found


def shared_shift_px(found: list[Flank]) -> float:
    """Standard uncertainty of one flank's position from its rows' significant mean residual (pixels).

    0 if there is none.

    Parameters
    ----------
    found : list of Flank
        All flanks of a picture that a codec has changed.
    """
    excess = [(_whole(flank) - flank.chance) / flank.gain**2 for flank in found]
    return float(np.sqrt(max(float(np.mean(excess)), 0.0))) if excess else 0.0


def even_shift_px(found: list[Flank]) -> float:
    """The same from the even part of the profile alone; 0 where noise would explain it.

    Parameters
    ----------
    found : list of Flank
        All flanks of a picture of which nobody says that it was changed.
    """
    if not found or np.mean([_whole(flank) / flank.chance for flank in found]) < LEAST_WHOLE:
        return 0.0
    even = [_even(flank) for flank in found]
    if np.mean([power / flank.chance for power, flank in zip(even, found, strict=True)]) < LEAST_EVEN:
        return 0.0
    excess = [(power - flank.chance) / flank.gain**2 for power, flank in zip(even, found, strict=True)]
    return float(np.sqrt(max(float(np.mean(excess)), 0.0)))


def _whole(flank: Flank) -> float:
    """Variance of a pixel's mean, from all residuals of the profile."""
    return float(flank.mean @ flank.mean) / (flank.mean.size - FITTED)


def _even(flank: Flank) -> float:
    """Variance of a pixel's mean, from the residuals of the even part of the profile.

    Light that falls off over the window, on either side of the edge, is not part of the edge and is excluded too.
    """
    half = 0.5 * flank.mean.size
    away = np.arange(flank.mean.size) + 0.5 - half - flank.offset_px
    waves = np.cos(np.arange(int(half) + 1)[:, None] * np.pi * away / half)
    _, by_position, _ = blurred_step(np.append(away - 0.5, away[-1] + 0.5), np.array([flank.sigma_px]))
    taken, _ = np.linalg.qr(np.stack((np.ones_like(away), by_position, np.abs(away)), axis=1))
    own = waves - (waves @ taken) @ taken.T
    power, direction = np.linalg.eigh(own @ own.T)
    is_own = power > LEAST_OWN * power[-1]
    seen = (direction[:, is_own].T @ (own @ flank.mean)) / np.sqrt(power[is_own])
    return float(seen @ seen) / float(np.count_nonzero(is_own))

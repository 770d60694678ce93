"""Mean residual over all rows of a flank: possible displacement of the flank as a whole.

If a codec, an interpolation or a filter affects all rows in the same way, the residuals do not average out over the
rows. The fit absorbs one component of the mean profile as a displacement; this invisible component is assumed to be
about as large as the visible components. A displacement adds a profile that is symmetric (even) about the edge. Optics
that spread light equally to both sides, whatever the shape of the blur, add an antisymmetric (odd) profile only.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import blurred_step, edge_filters
from fingervision.vision.edges import EdgePoints
from fingervision.vision.facing import facing_lines
from fingervision.vision.grey import GreyImage
from fingervision.vision.line_levels import line_levels

Floats = NDArray[np.float64]

# Least number of rows of a flank, and largest slope (change of the edge from row to row).
FEWEST_ROWS, STEEPEST = 8, 0.3
# Number of degrees of freedom of a window that the fit absorbs: level, contrast, position and blur; and without the
# blur, which is common to all rows.
FITTED, FITTED_BY_ROW = 4, 3
# Ratios of the mean profile's variance to that expected for rows with independent noise, above which the mean profile
# is significant: for the whole profile, and for its even part. In 99.9 % of pictures without common errors, the mean
# over four flanks is below these limits (for four even profiles each: chi-square of 16).
LEAST_WHOLE, LEAST_EVEN = 1.5, 2.45
# Least share of a profile's power that the fit does not absorb; profiles with less are not used.
LEAST_OWN = 1e-3

_means = loop("shared_profile_means")


class Flank(NamedTuple):
    """Mean residual profile over the rows of one flank.

    Parameters
    ----------
    mean : ndarray of float, shape (pixels,)
        Mean residual of each pixel over the rows, from inside to outside.
    chance : float
        Variance that each pixel's mean over the rows would have if the rows had independent errors.
    offset_px : float
        Mean distance of the edge from the window's middle.
    sigma_px : float
        Blur of the edge.
    gain : float
        Change of the levels per pixel of displacement, as root of the sum of squares over the window: contrast times
        the filters' gain.
    """

    mean: Floats
    chance: float
    offset_px: float
    sigma_px: float
    gain: float


def flanks(upright: GreyImage, edges: EdgePoints, light: Floats) -> list[Flank]:
    """Mean residuals of all flanks that are long and upright enough; none if the fingers' windows overlap.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels of the picture, turned so that the tips point up.
    edges : EdgePoints
        Edges fitted to the picture.
    light : ndarray of float, shape (levels,)
        Light for every grey level (look-up table).
    """
    if facing_lines(edges.lines, edges.reach_px) is not None:
        return []
    levels = line_levels(upright, edges.lines, light, edges.reach_px)
    lines, filters, pixels = edges.lines, edge_filters(edges.reach_px), levels.shape[-1]
    means, numbers = np.empty((2, 2, pixels)), np.empty((2, 2, 4))
    seen = (edges.position, lines.coarse, lines.outward, edges.contrast, lines.weight, lines.slope, edges.blur_px)
    _means(levels, *seen, means, numbers)
    found = []
    for finger, sides, sigma in zip(means, numbers.tolist(), edges.blur_px[:, 0].tolist(), strict=True):
        unit_gain = float(filters.shift_gain[filters.middle(sigma)])
        for mean_profile, (rows, square, place, contrast) in zip(finger, sides, strict=True):
            if rows < FEWEST_ROWS or square <= 0.0:
                continue
            chance = square * pixels / ((pixels - FITTED_BY_ROW) * rows)
            found.append(Flank(mean_profile, chance, place, sigma, max(abs(contrast) * unit_gain, 1e-9)))
    return found


def shared_shift_px(found: list[Flank]) -> float:
    """Standard uncertainty of one flank's position from its rows' significant mean residual (pixels).

    The result is 0 if no mean residual is significant.

    Parameters
    ----------
    found : list of Flank
        All flanks of a picture that a codec has changed.
    """
    excess = [(_whole(flank) - flank.chance) / flank.gain**2 for flank in found]
    return sqrt(max(mean(excess), 0.0)) if excess else 0.0


def even_shift_px(found: list[Flank]) -> float:
    """Standard uncertainty of a flank's position from the even part of its mean residual profile only (pixels).

    The result is 0 if noise explains the profile.

    Parameters
    ----------
    found : list of Flank
        All flanks of a picture that is not known to have been changed after it was taken.
    """
    if not found or mean([_whole(flank) / flank.chance for flank in found]) < LEAST_WHOLE:
        return 0.0
    even = [_even(flank) for flank in found]
    if mean([power / flank.chance for power, flank in zip(even, found, strict=True)]) < LEAST_EVEN:
        return 0.0
    excess = [(power - flank.chance) / flank.gain**2 for power, flank in zip(even, found, strict=True)]
    return sqrt(max(mean(excess), 0.0))


def mean(values: list[float]) -> float:
    """Arithmetic mean of a few numbers."""
    return sum(values) / len(values)


def _whole(flank: Flank) -> float:
    """Variance of each pixel's mean over the rows, estimated from all residuals of the profile."""
    return float(flank.mean @ flank.mean) / (flank.mean.size - FITTED)


def _even(flank: Flank) -> float:
    """Variance of each pixel's mean over the rows, from the residuals of the profile's symmetric (even) part.

    A linear decrease of light over the window on both sides of the edge is not part of the edge, and is excluded as
    well.
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

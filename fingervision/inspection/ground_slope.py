"""Slope of the background's light towards each inner edge, from the whole half of the gap beside it.

The window of an edge's fit is only a few pixels long. Over such a length the slope of uneven light is hardly larger
than that of a pattern on the background; over half of the gap the pattern averages out.

Fit of a symmetrically blurred step between two plateaus, which may slope, to the mean profile of a flank.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ndtr

from fingervision.inspection.look import Look
from fingervision.vision.profile_lines import INNER

Floats = NDArray[np.float64]

# A symmetric point spread that is not Gaussian (a disc, a box, sharpening) is modelled by the sum of two Gaussians, the
# second of which is wider by this factor.
WIDER = 1.8
# Limits of the fitted blur (pixels).
LEAST_BLUR_PX, LARGEST_BLUR_PX = 0.2, 8.0


@dataclass(frozen=True, slots=True, eq=False)
class StepProfile:
    """Mean light across one flank; arrays of shape (n,).

    Parameters
    ----------
    away_px : ndarray of float
        Distance from the fitted edge, perpendicular to it.
    level : ndarray of float
        Mean light at this distance.
    u_level : ndarray of float
        Standard uncertainty of the mean.
    """

    away_px: Floats
    level: Floats
    u_level: Floats


@dataclass(frozen=True, slots=True)
class ProfileFit:
    """Best fit of a step to one profile.

    Parameters
    ----------
    position_px : float
        Position of the edge, outwards from the profile's zero.
    chi_square : float
        Sum of squared residuals, in units of the bins' own noise.
    freedom : int
        Number of bins minus number of parameters.
    slope_share : float
        Larger of the two plateaus' changes of level over the window, as a share of the contrast; 0 for level plateaus.
    """

    position_px: float
    chi_square: float
    freedom: int
    slope_share: float = 0.0


def fit_step(profile: StepProfile, blur_px: float, *, sloping: bool) -> ProfileFit:
    """Fit a step to a profile by least squares.

    Parameters
    ----------
    profile : StepProfile
        Mean light across the flank.
    blur_px : float
        Initial estimate of the blur.
    sloping : bool
        Whether the plateaus may slope (uneven light).
    """
    weight = 1.0 / profile.u_level

    def residual(p: Floats) -> Floats:
        design = _design(profile, p[0], float(np.exp(p[1])), sloping) * weight[:, None]
        value = profile.level * weight
        solved, *_ = np.linalg.lstsq(design, value, rcond=None)
        return np.asarray(value - design @ solved)

    start = np.array([0.0, np.log(np.clip(blur_px, 1.1 * LEAST_BLUR_PX, 0.9 * LARGEST_BLUR_PX))])
    limits = ([-3.0, np.log(LEAST_BLUR_PX)], [3.0, np.log(LARGEST_BLUR_PX)])
    found = least_squares(residual, start, bounds=limits, xtol=1e-8, ftol=1e-8, max_nfev=60)
    parameters = 7 if sloping else 5
    share = _slope_share(profile, float(found.x[0]), float(np.exp(found.x[1]))) if sloping else 0.0
    return ProfileFit(float(found.x[0]), float(2.0 * found.cost), max(profile.level.size - parameters, 1), share)


def _slope_share(profile: StepProfile, position: float, blur: float) -> float:
    weight = 1.0 / profile.u_level
    design = _design(profile, position, blur, sloping=True)
    solved, *_ = np.linalg.lstsq(design * weight[:, None], profile.level * weight, rcond=None)
    reach = position - profile.away_px[0], profile.away_px[-1] - position
    changes = [abs(slope) * part for slope, part in zip(solved[3:], reach, strict=True)]
    return float(max(changes) / max(abs(solved[1]), 1e-9))


def _design(profile: StepProfile, position: float, blur: float, sloping: bool) -> Floats:
    away = profile.away_px - position
    step = _pixel_step(away, blur)
    wide = _pixel_step(away, WIDER * blur)
    columns = [np.ones_like(away), step, wide - step]
    if sloping:
        columns += [away * (1.0 - step), away * step]
    return np.stack(columns, axis=1)


def _pixel_step(away: Floats, sigma: float) -> Floats:
    """Gaussian-blurred unit step, averaged over the width of a pixel."""
    upper, lower = (away + 0.5) / sigma, (away - 0.5) / sigma
    density = (np.exp(-0.5 * upper**2) - np.exp(-0.5 * lower**2)) / np.sqrt(2.0 * np.pi)
    return np.asarray(sigma * (upper * ndtr(upper) - lower * ndtr(lower) + density))


# Distance of the nearest pixels from the edge, as a multiple of its blur, and farthest distance (pixels).
BEYOND_BLURS, FARTHEST_PX = 3.0, 40.0
# Smallest number of pixels across and of rows from which a slope is computed.
FEWEST_ACROSS, FEWEST_ROWS = 8, 6
# Number of parts of a flank whose slopes are compared: a pattern on the background differs from part to part.
PARTS = 4
# Slope (share of the contrast per pixel) by which the shift of a fitted edge is computed, and distance between the
# points of its profile (pixels).
SMALL_SLOPE, STEP_PX = 0.005, 0.25


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
    reach_px = float(np.median([look.edges.reach_px for look in looks]))
    gain = _shift_per_slope_px2(max(blur_px, STEP_PX), reach_px)
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


def _shift_per_slope_px2(blur_px: float, reach_px: float) -> float:
    """Shift of a fitted step (px) per slope of the outer plateau (share of the contrast per px)."""
    away = np.arange(-reach_px, reach_px + 0.5 * STEP_PX, STEP_PX)
    step, alike = ndtr(away / blur_px), np.ones_like(away)
    fits = [
        fit_step(StepProfile(away, step + slope * np.maximum(away, 0.0), alike), blur_px, sloping=False)
        for slope in (0.0, SMALL_SLOPE)
    ]
    return (fits[1].position_px - fits[0].position_px) / SMALL_SLOPE

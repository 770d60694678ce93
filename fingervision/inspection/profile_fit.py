"""Fit of a symmetrically blurred step between two plateaus, which may slope, to the mean profile of a flank."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ndtr

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

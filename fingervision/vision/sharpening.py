"""Sharpening inside a camera with a curved response: it acts on stored levels, and so displaces the edge in light.

In stored levels, an unsharp mask adds as much to the light side of an edge as it takes from the dark side. After
conversion to light the two amounts differ, so that a step fitted in light is displaced from the edge. The effect of the
mask is visible in the mean profile of a flank in stored levels. The mean profile is fitted by a blurred step of light,
encoded by the response, plus a fraction of the difference between the encoded step and a blurred copy of it. A step is
then fitted to the fitted profile after conversion to light; its distance from the true edge is the correction of the
whole outline.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]

# Least curvature of a response: distance between the light at half of the levels' range and half of the light, as a
# share of the range.
CURVED = 0.02
# Spacing and extent to either side of the grid on which the profile is modelled (pixels).
GRID_PX, REACH_PX = 0.25, 20.0
# Starting value of the mask's amount; standard deviations of the priors of the radius's logarithm (about one pixel, as
# in usual cameras) and of the amount. The priors are needed because a single profile hardly distinguishes blur, amount
# and radius. Limits of the two positions (pixels), blur, amount and logarithm of the radius.
START_AMOUNT, U_LOG_RADIUS, U_AMOUNT = 0.4, 0.2, 0.5
LEAST = np.array([-5.0, -5.0, 0.3, -0.2, -0.7])
MOST = np.array([5.0, 5.0, 5.0, 3.0, 1.4])
BLUR, AMOUNT, LOG_RADIUS = 2, 3, 4
ITERATIONS, STEP, SETTLED = 12, 1e-3, 1e-4
# A mask is significant if it explains this multiple of the remaining variance and has this least amount.
SIGNIFICANT, LEAST_AMOUNT = 12.0, 0.1
# Relative standard uncertainty of the shift, because real masks are not exactly Gaussian.
U_SHIFT = 0.4

_soften = loop("sharpening_softened")


@dataclass(frozen=True, slots=True)
class Sharpening:
    """Sharpening found in a picture.

    Parameters
    ----------
    shift_px : (float, float)
        Distance outwards from the step fitted in light to the edge, for the left and the right finger.
    amount, radius_px : float
        Amount and radius of the unsharp mask.
    """

    shift_px: tuple[float, float]
    amount: float
    radius_px: float


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Mean stored level across a flank: distance outwards from the step fitted in light, level, number of pixels."""

    t: Floats
    level: Floats
    count: Floats


def is_curved(light: Floats, top_level: int) -> bool:
    """Whether stored levels are not proportional to light."""
    return abs(float(light[top_level // 2]) / float(light[top_level]) - 0.5) > CURVED


def sharpening(profiles: tuple[Profile, Profile], light: Floats, top_level: int, blur_px: float) -> Sharpening | None:
    """Estimate an unsharp mask from the mean profiles of both inner flanks; None if there is none.

    Parameters
    ----------
    profiles : (Profile, Profile)
        Mean profiles of the left and the right finger.
    light : ndarray of float, shape (levels,)
        Light for every stored level (look-up table).
    top_level : int
        Highest level of the scale.
    blur_px : float
        Blur of the step fitted in light, the pixel's width included.
    """
    stored = np.arange(top_level + 1.0)
    curve = np.ascontiguousarray(light[: top_level + 1])
    grid = np.arange(-REACH_PX, REACH_PX + GRID_PX, GRID_PX)
    ends = [
        np.interp([p.level[p.t < p.t.min() + 6.0].mean(), p.level[p.t > p.t.max() - 6.0].mean()], stored, curve)
        for p in profiles
    ]

    def residuals(p: Floats) -> Floats:
        found = []
        for k, (profile, (inside, outside)) in enumerate(zip(profiles, ends, strict=True)):
            levels = np.interp(inside + (outside - inside) * ndtr((grid - p[k]) / p[BLUR]), curve, stored)
            if p[AMOUNT]:
                levels = levels + p[AMOUNT] * (levels - _softened(levels, float(np.exp(p[LOG_RADIUS])) / GRID_PX))
            found.append(_adjusted(np.interp(profile.t, grid, levels), profile.level, np.sqrt(profile.count)))
        return np.concatenate(found)

    start = np.array([0.0, 0.0, blur_px, 0.0, 0.0])
    plain = _fitted(residuals, start, 3)
    bins = sum(profile.t.size for profile in profiles)
    squares = float(np.sum(residuals(plain) ** 2))
    scale = np.sqrt(squares / bins)

    def held(p: Floats) -> Floats:
        return np.append(residuals(p), [scale * p[AMOUNT] / U_AMOUNT, scale * p[LOG_RADIUS] / U_LOG_RADIUS])

    start = plain + np.array([0.0, 0.0, 0.15 * plain[BLUR], START_AMOUNT, 0.0])
    p = _fitted(held, start, 5)
    left = float(np.sum(residuals(p) ** 2))
    if squares - left < SIGNIFICANT * left / bins or p[AMOUNT] < LEAST_AMOUNT:
        return None
    return Sharpening((float(p[0]), float(p[1])), float(p[AMOUNT]), float(np.exp(p[LOG_RADIUS])))


def _fitted(residuals: Callable[[Floats], Floats], start: Floats, free: int) -> Floats:
    """Least squares by Levenberg and Marquardt over the first `free` parameters."""
    p, damping = start.copy(), 1e-2
    base = residuals(p)
    left = float(base @ base)
    for _iteration in range(ITERATIONS):
        jacobian = np.empty((base.size, free))
        for a in range(free):
            moved = p.copy()
            moved[a] += STEP
            jacobian[:, a] = (residuals(moved) - base) / STEP
        gradient, normal = jacobian.T @ base, jacobian.T @ jacobian
        before = left
        for _try in range(5):
            move = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), -gradient)
            new = p.copy()
            new[:free] = np.clip(p[:free] + np.clip(move, -0.7, 0.7), LEAST[:free], MOST[:free])
            other = residuals(new)
            squares = float(other @ other)
            if squares < left:
                p, base, left, damping = new, other, squares, 0.3 * damping
                break
            damping *= 5.0
        if before - left < SETTLED * before:
            break
    return p


def _adjusted(model: Floats, level: Floats, root: Floats) -> Floats:
    """Weighted residuals, with the model's offset and scale at their least-squares values."""
    basis = np.column_stack((root, root * model))
    seen = root * level
    return np.asarray(basis @ np.linalg.solve(basis.T @ basis, basis.T @ seen) - seen)


def _softened(levels: Floats, sigma: float) -> Floats:
    """Gaussian blur of a row of levels; the end values are repeated beyond the ends."""
    soft = np.empty(levels.size)
    _soften(levels, sigma, soft)
    return soft

"""Centre of a mark with two-fold rotational symmetry: dots, crosses, corners of a chessboard.

The picture is compared with its reflection through a point, `I(c + x) - I(c - x)`; the centre is the point with the
least sum of squares (Gauss-Newton). Only the symmetry is assumed, not the mark's size, blur or tone. The variance is
that of a fit with known shape of the mark, `sigma^2 (sum g g')^-1`, the Cramer-Rao bound: the gradient of the
difference is doubled, and the variance of its noise is doubled too. Pixels count as far as the gradients of their ring
exceed the noise. A linear gradient of light is subtracted.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.patch_covariance import LEAST_INFORMATION, ROUNDING
from fingervision.vision.patch_reference import MARGIN_PX
from fingervision.vision.spline_interpolation import coefficients, interpolated_power, sampled

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.intp]

ITERATIONS, SETTLED_PX, NEAR_PX, LARGEST_STEP_PX = 30, 2e-3, 0.02, 1.0
# Number of pixels beyond the window that the five-point formula for derivatives needs, and its variance for unit noise.
# The three-point formula would underestimate the gradients of an edge with a blur of one pixel by a tenth, and
# overestimate the uncertainty accordingly.
RIM, DIFFERENCE_POWER = 2, 130.0 / 144.0


@dataclass(frozen=True, slots=True, eq=False)
class Symmetric:
    """Centre of a point-symmetric mark.

    Parameters
    ----------
    x_px, y_px : float
        Centre, in pixels of the given part of the picture.
    covariance : ndarray of float, shape (2, 2)
        Covariance of x and y.
    half_turn, quarter_turn, any_turn : float
        Correlation of the mark with itself rotated by 180 and by 90 degrees, and correlation of its levels with the
        mean of each ring around the centre.
    spread : float
        Standard deviation of the mark's levels, with a plane of light subtracted.
    noise : float
        Standard deviation of the noise.
    """

    x_px: float
    y_px: float
    covariance: Doubles
    half_turn: float
    quarter_turn: float
    any_turn: float
    spread: float
    noise: float


class NoSymmetryError(ValueError):
    """There is no centre of symmetry near the initial estimate."""


def fit_symmetry(part: Floats, start: tuple[float, float], half_px: int, shared_pixels: float = 1.0) -> Symmetric:
    """Find the centre of a point-symmetric mark.

    Parameters
    ----------
    part : ndarray of float32, shape (height, width)
        Light around the mark, at least `MARGIN_PX` beyond the window.
    start : (float, float)
        Initial estimate of x and y, accurate to a few pixels.
    half_px : int
        Half width of the window.
    shared_pixels : float
        Number of neighbouring pixels that share an error (from a codec) and count as one pixel.

    Raises
    ------
    NoSymmetryError
        If the search leaves the part or does not converge.
    """
    flat = coefficients(part).ravel()
    height, width = part.shape
    size = 2 * half_px + 1
    y, x = np.mgrid[-half_px - RIM : half_px + RIM + 1, -half_px - RIM : half_px + RIM + 1].astype(np.float32)
    inner = (slice(RIM, -RIM), slice(RIM, -RIM))
    dx, dy = (v[inner].ravel().astype(np.float64) for v in (x, y))
    basis = np.stack((dx, dy)) / np.sqrt((dx**2).sum())
    at_x, at_y = start
    ring = np.rint(np.hypot(dx, dy)).astype(np.intp)
    begin = np.zeros(1, dtype=np.intp)

    def window(turned: bool = False) -> Floats:
        across, down = (-y, x) if turned else (x, y)
        px, py = (across + np.float32(at_x)).reshape(1, -1), (down + np.float32(at_y)).reshape(1, -1)
        if px.min() < 2 or py.min() < 2 or px.max() >= width - 3 or py.max() >= height - 3:
            raise NoSymmetryError("the mark lies partly outside its search zone")
        return sampled(flat, begin, width, px, py).reshape(size + 2 * RIM, size + 2 * RIM)

    length, is_near = np.inf, False
    for _iteration in range(ITERATIONS):
        seen = window()
        difference = (seen[inner] - seen[inner][::-1, ::-1]).ravel().astype(np.float64)
        difference -= (basis @ difference) @ basis
        by_x, by_y = _derivative(seen[RIM:-RIM]), _derivative(seen[:, RIM:-RIM].T).T
        odd = np.stack([(g - g[::-1, ::-1]).ravel() for g in (by_x, by_y)])
        odd -= (odd @ basis.T) @ basis
        # Far from the centre, the difference shows the mark itself and not the noise.
        is_near |= length < NEAR_PX
        weight = _weights(odd, difference, ring, (at_x, at_y)) if is_near else np.ones(difference.size)
        normal = (weight * odd) @ odd.T
        if np.linalg.det(normal) <= 0.0:
            raise NoSymmetryError("the mark has no contrast")
        step = -np.linalg.solve(normal, (weight * odd) @ difference)
        length = float(np.hypot(*step))
        step *= min(1.0, LARGEST_STEP_PX / max(length, 1e-12))
        at_x, at_y = at_x + float(step[0]), at_y + float(step[1])
        if is_near and length < SETTLED_PX:
            break
    else:
        raise NoSymmetryError("the search does not converge")
    solved = (normal, (weight**2 * odd) @ odd.T, float(weight.sum()), difference)
    return _judged(window(), window(turned=True), (at_x, at_y), solved, half_px, shared_pixels)


def _variance(difference: Doubles, at: tuple[float, float]) -> float:
    """Variance of the noise: the difference is antisymmetric, so that only half of its pixels are independent."""
    phases = interpolated_power(at[0]) * interpolated_power(at[1])
    return max(float(np.mean(difference**2)) / 2.0 / phases * difference.size / (difference.size - 8), ROUNDING)


def _noisy(difference: Doubles, at: tuple[float, float]) -> float:
    """Variance of a component of the gradients, of one pixel."""
    phases = interpolated_power(at[0]) * interpolated_power(at[1])
    return 2.0 * _variance(difference, at) * phases * DIFFERENCE_POWER


def _weights(odd: Doubles, difference: Doubles, ring: Indices, at: tuple[float, float]) -> Doubles:
    """Weight of every pixel: the share of its ring's mean squared gradient that is not noise (Wiener's filter).

    Gradients of flat ground are noise alone; unweighted, they would let the noise of the ground move the centre.
    """
    power = np.bincount(ring, (odd**2).sum(axis=0)) / np.maximum(np.bincount(ring), 1)
    share = 1.0 - 2.0 * _noisy(difference, at) / np.maximum(power, 1e-30)
    return np.asarray(np.maximum(share, 0.0)[ring])


def _judged(
    seen: Floats,
    turned: Floats,
    at: tuple[float, float],
    solved: tuple[Doubles, Doubles, float, Doubles],
    half_px: int,
    shared_pixels: float,
) -> Symmetric:
    normal, squared, weights, difference = solved
    inner = (slice(RIM, -RIM), slice(RIM, -RIM))
    y, x = np.mgrid[-half_px : half_px + 1, -half_px : half_px + 1]
    # The corners of a square window are not compared, only the disc inside it.
    disc = np.hypot(x, y) <= half_px
    basis = np.stack((np.ones(disc.sum()), x[disc], y[disc]))
    levels = _plane_off(seen[inner][disc].astype(np.float64), basis)
    reflected = _plane_off(seen[inner][::-1, ::-1][disc].astype(np.float64), basis)
    quarter = _plane_off(turned[inner][disc].astype(np.float64), basis)
    ring = np.rint(np.hypot(x, y)[disc]).astype(np.intp)
    mean = (np.bincount(ring, levels) / np.maximum(np.bincount(ring), 1))[ring]
    power = max(float(levels @ levels), 1e-12)
    variance = _variance(difference, at)
    noisy = np.eye(2) * _noisy(difference, at) * weights
    true = normal - noisy
    size = np.sqrt(np.maximum(np.diag(normal), 1e-30))
    covariance = np.diag([np.inf, np.inf])
    if np.linalg.eigvalsh(true / np.outer(size, size))[0] > LEAST_INFORMATION:
        own = np.linalg.inv(true)
        # `normal` is a sum over all pixels, which counts each pair twice with (2 g)^2, g being the gradient; the noise
        # variance of a pair's difference is 2 sigma^2.
        covariance = 4.0 * variance * shared_pixels * own @ squared @ own
    return Symmetric(
        at[0], at[1], covariance, float(levels @ reflected) / power,
        float(levels @ quarter) / max(float(np.sqrt(power * (quarter @ quarter))), 1e-12),
        float(np.sqrt((mean @ mean) / power)), float(np.sqrt(power / levels.size)), float(np.sqrt(variance)),
    )  # fmt: skip


def _derivative(seen: Floats) -> Doubles:
    """Derivative of each row's levels along the row, except in the two columns at either end."""
    levels = seen.astype(np.float64)
    return (8.0 * (levels[:, 3:-1] - levels[:, 1:-3]) - levels[:, 4:] + levels[:, :-4]) / 12.0


def _plane_off(levels: Doubles, basis: Doubles) -> Doubles:
    return np.asarray(levels - np.linalg.lstsq(basis.T, levels, rcond=None)[0] @ basis)


# Number of pixels beyond a mark's window that the fit needs.
BEYOND_PX = MARGIN_PX + 2

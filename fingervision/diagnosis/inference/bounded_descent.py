"""Least squares between bounds: the steps of a Levenberg-Marquardt search (Marquardt 1963, doi:10.1137/0111030)."""

from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array

AT_BOUND = 1e-6
"""Share of a parameter's range within which it lies at its bound: rounding of the search."""
TRIALS = 5
"""Dampings that are tried in one step, each eight times the one before: the last is a step along the gradient."""
SMALLEST_GAIN, SMALLEST_GAIN_SHARE = 0.02, 1e-5
"""A step that lowers chi-square by less ends the search: a hundredth of a standard deviation changes no answer."""


class LeastSquares(Protocol):
    """Protocol of what is minimised: a weighted sum of squares whose weights may depend on the residual."""

    def residual(self, x: Array) -> Array:
        """Target minus prediction, shape (m,), at parameters of shape (p,)."""

    def squared(self, residual: Array) -> float:
        """Weighted sum of squares of a residual."""

    def linearised(self, x: Array, residual: Array) -> tuple[Array, Array]:
        """Normal matrix, shape (p, p), and gradient of the sum of squares, shape (p,)."""

    def reweighted(self, residual: Array) -> Self:
        """Choose the weights that suit a residual."""


Weighted = TypeVar("Weighted", bound=LeastSquares)


@dataclass(frozen=True, slots=True, eq=False)
class Descent(Generic[Weighted]):
    """Result of a bounded least-squares search.

    Parameters
    ----------
    squares : LeastSquares
        What was minimised, with its last weights.
    x : ndarray of float, shape (p,)
        Parameters.
    residual : ndarray of float, shape (m,)
        With them.
    cost : float
        Weighted sum of squares.
    normal : ndarray of float, shape (p, p)
        Normal matrix of the last step.
    free : ndarray of bool, shape (p,)
        Parameters that no bound holds.
    """

    squares: Weighted
    x: Array
    residual: Array
    cost: float
    normal: Array
    free: NDArray[np.bool_]

    def covariance(self) -> Array:
        """Covariance of the parameters, shape (p, p); zero rows for those at a bound."""
        out = np.zeros_like(self.normal)
        if self.free.any():
            part, scale = _in_own_units(self.normal, self.free)
            out[np.ix_(self.free, self.free)] = scale[:, None] * np.linalg.pinv(part) * scale
        return out


def descend(squares: Weighted, start: Array, lower: Array, upper: Array, iterations: int) -> Descent[Weighted]:
    """Reduce a sum of squares within bounds.

    Parameters
    ----------
    squares : LeastSquares
        What is minimised.
    start, lower, upper : ndarray of float, shape (p,)
        Where to begin, and the bounds.
    iterations : int
        Steps at most.
    """
    x, damping = start, 1e-3
    residual = squares.residual(x)
    squares = squares.reweighted(residual)
    cost = squares.squared(residual)
    normal, free = np.zeros((x.size, x.size)), np.ones(x.size, dtype=bool)
    for step_number in range(iterations):
        normal, pull = squares.linearised(x, residual)
        free = _free(x, pull, normal, lower, upper)
        if not free.any():
            break
        part, scale = _in_own_units(normal, free)
        gained = 0.0
        for _ in range(TRIALS):
            trial = x.copy()
            reach = ((lower - x)[free] / scale, (upper - x)[free] / scale)
            trial[free] += scale * bounded_step(part + damping * np.eye(scale.size), scale * pull[free], reach)
            trial = np.clip(trial, lower, upper)
            rest = squares.residual(trial)
            new = squares.squared(rest)
            if new < cost:
                gained = cost - new
                x, residual, cost, damping = trial, rest, new, max(damping / 10.0, 1e-7)
                break
            damping *= 8.0
        squares = squares.reweighted(residual)
        cost = squares.squared(residual)
        if gained < SMALLEST_GAIN + SMALLEST_GAIN_SHARE * cost and step_number > 0:
            break
    return Descent(squares, x, residual, cost, normal, free)


def bounded_step(matrix: Array, pull: Array, bounds: tuple[Array, Array]) -> Array:
    """Minimise a quadratic form within bounds, to the accuracy that a search step needs.

    A parameter that would exceed its bound is fixed there and the others are solved again. If it were only clipped, the
    others would keep values that suit a step which is not made.

    Parameters
    ----------
    matrix : ndarray of float, shape (p, p)
        Half the second derivatives.
    pull : ndarray of float, shape (p,)
        Half the downward slope.
    bounds : tuple of ndarray of float, each of shape (p,)
        Least and largest step of each parameter; they enclose zero.

    Returns
    -------
    ndarray of float, shape (p,)
        The step.
    """
    step: Array = np.asarray(np.linalg.lstsq(matrix, pull, rcond=1e-12)[0], dtype=np.float64)
    held = np.zeros(pull.size, dtype=bool)
    if not np.any((step < bounds[0]) | (step > bounds[1])):
        return step
    for _ in range(pull.size):
        loose = ~held
        rest = pull[loose] - matrix[np.ix_(loose, held)] @ step[held]
        step[loose] = np.linalg.lstsq(matrix[np.ix_(loose, loose)], rest, rcond=1e-12)[0]
        beyond = loose & ((step < bounds[0]) | (step > bounds[1]))
        if not beyond.any():
            break
        held |= beyond
        step = np.where(held, np.clip(step, *bounds), step)
        if held.all():
            break
    return step


def _free(x: Array, pull: Array, normal: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Which parameters may move: those that no bound blocks and that the data determine."""
    near = AT_BOUND * (upper - lower)
    held = ((x <= lower + near) & (pull <= 0.0)) | ((x >= upper - near) & (pull >= 0.0))
    return np.asarray(~held & (np.diag(normal) > 1e-12), dtype=bool)


def _in_own_units(normal: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Scale the free part of the normal matrix so that each parameter is in units of its own precision.

    Without scaling, a time constant in hours beside micrometres would make the matrix singular.
    """
    part = normal if free.all() else normal[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-300))
    return scale[:, None] * part * scale, scale

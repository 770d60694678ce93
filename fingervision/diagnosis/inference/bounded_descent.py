"""Least squares between bounds: the steps of a Levenberg-Marquardt search (Marquardt 1963, doi:10.1137/0111030)."""

from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array

AT_BOUND = 1e-6
"""Distance from a bound, as a share of the parameter's range, within which a parameter counts as lying at the bound."""
TRIALS = 5
"""Number of damping values tried in one iteration, each eight times the one before: the largest value gives a step
along the gradient."""
SMALLEST_GAIN, SMALLEST_GAIN_SHARE = 0.02, 1e-5
"""Smallest reduction of chi-square, absolute and relative, for which the search continues: less changes parameters by
under a hundredth of a standard deviation."""


class LeastSquares(Protocol):
    """Protocol of a function to be minimised: a weighted sum of squares whose weights may depend on the residual."""

    def residual(self, x: Array) -> Array:
        """Target minus prediction, shape (m,), at parameters of shape (p,)."""

    def squared(self, residual: Array) -> float:
        """Weighted sum of squares of a residual."""

    def linearised(self, x: Array, residual: Array) -> tuple[Array, Array]:
        """Normal matrix, shape (p, p), and gradient of the sum of squares, shape (p,), at given parameters."""

    def reweighted(self, residual: Array) -> Self:
        """Return the same function with weights chosen for a given residual."""


Weighted = TypeVar("Weighted", bound=LeastSquares)


@dataclass(frozen=True, slots=True, eq=False)
class Descent(Generic[Weighted]):
    """Result of a bounded least-squares search.

    Parameters
    ----------
    squares : LeastSquares
        The minimised function, with its last weights.
    x : ndarray of float, shape (p,)
        Parameters.
    residual : ndarray of float, shape (m,)
        Residual at these parameters.
    cost : float
        Weighted sum of squares.
    normal : ndarray of float, shape (p, p)
        Normal matrix of the last step.
    free : ndarray of bool, shape (p,)
        Parameters that are not at a bound.
    """

    squares: Weighted
    x: Array
    residual: Array
    cost: float
    normal: Array
    free: NDArray[np.bool_]

    def covariance(self) -> Array:
        """Covariance of the parameters, shape (p, p); rows of parameters at a bound are zero."""
        out = np.zeros_like(self.normal)
        if self.free.any():
            part, scale = _in_own_units(self.normal, self.free)
            out[np.ix_(self.free, self.free)] = scale[:, None] * np.linalg.pinv(part) * scale
        return out


def descend(squares: Weighted, start: Array, lower: Array, upper: Array, iterations: int) -> Descent[Weighted]:
    """Minimise a sum of squares within bounds.

    Parameters
    ----------
    squares : LeastSquares
        Function to be minimised.
    start, lower, upper : ndarray of float, shape (p,)
        Starting point and bounds.
    iterations : int
        Largest number of iterations.
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

    A parameter that would exceed its bound is fixed at the bound, and the other parameters are solved for again. If the
    parameter at its bound were only clipped, the other parameters would keep values that belong to a step that is not
    taken.

    Parameters
    ----------
    matrix : ndarray of float, shape (p, p)
        Half the second derivatives.
    pull : ndarray of float, shape (p,)
        Half the negative gradient.
    bounds : tuple of ndarray of float, each of shape (p,)
        Smallest and largest step of each parameter; the interval includes zero.

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
    """Mask of the free parameters: those that no bound blocks and that the data determine."""
    near = AT_BOUND * (upper - lower)
    held = ((x <= lower + near) & (pull <= 0.0)) | ((x >= upper - near) & (pull >= 0.0))
    return np.asarray(~held & (np.diag(normal) > 1e-12), dtype=bool)


def _in_own_units(normal: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Scale the free part of the normal matrix so that each parameter is in units of its own standard error.

    Without scaling, parameters as different as a time constant in hours and a play in micrometres would make the matrix
    singular.
    """
    part = normal if free.all() else normal[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-300))
    return scale[:, None] * part * scale, scale

"""Fit a hypothesis: the effects are placed in the measuring chain and fitted jointly by generalised least squares."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.parameter_priors import inner_price, places_price, starts_price
from fingervision.domain.effect import Array
from fingervision.domain.parameter import Parameter

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


def descend(
    squares: Weighted,
    start: Array,
    lower: Array,
    upper: Array,
    iterations: int,
    leaving: Callable[[Array], Array] = np.zeros_like,
) -> Descent[Weighted]:
    """Minimise a sum of squares within bounds.

    Parameters
    ----------
    squares : LeastSquares
        Function to be minimised.
    start, lower, upper : ndarray of float, shape (p,)
        Starting point and bounds.
    iterations : int
        Largest number of iterations.
    leaving : callable
        Returns, for the diagonal of the normal matrix, by how much each parameter must reduce the sum of squares to
        leave a bound.
    """
    x, damping = start, 1e-3
    residual = squares.residual(x)
    squares = squares.reweighted(residual)
    cost = squares.squared(residual)
    normal, free = np.zeros((x.size, x.size)), np.ones(x.size, dtype=bool)
    for step_number in range(iterations):
        normal, pull = squares.linearised(x, residual)
        free = _free(x, pull, np.diag(normal), (lower, upper), leaving(np.diag(normal)))
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
        Half the second derivatives, positive definite.
    pull : ndarray of float, shape (p,)
        Half the negative gradient.
    bounds : tuple of ndarray of float, each of shape (p,)
        Smallest and largest step of each parameter; the interval includes zero.

    Returns
    -------
    ndarray of float, shape (p,)
        The step.
    """
    step: Array = np.asarray(np.linalg.solve(matrix, pull), dtype=np.float64)
    held = np.zeros(pull.size, dtype=bool)
    if not np.any((step < bounds[0]) | (step > bounds[1])):
        return step
    for _ in range(pull.size):
        loose = ~held
        rest = pull[loose] - matrix[np.ix_(loose, held)] @ step[held]
        step[loose] = np.linalg.solve(matrix[np.ix_(loose, loose)], rest)
        beyond = loose & ((step < bounds[0]) | (step > bounds[1]))
        if not beyond.any():
            break
        held |= beyond
        step = np.where(held, np.clip(step, *bounds), step)
        if held.all():
            break
    return step


def _free(x: Array, pull: Array, curvature: Array, bounds: tuple[Array, Array], least: Array) -> NDArray[np.bool_]:
    """Mask of the free parameters: those that no bound holds and that the data determine."""
    lower, upper = bounds
    near = AT_BOUND * (upper - lower)
    # Away from the bound, the sum of squares falls by pull^2 / curvature.
    leaves = pull * np.abs(pull) / np.maximum(curvature, 1e-300)
    held = ((x <= lower + near) & (leaves <= least)) | ((x >= upper - near) & (leaves >= -least))
    return np.asarray(~held & (curvature > 1e-12), dtype=bool)


def _in_own_units(normal: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Scale the free part of the normal matrix so that each parameter is in units of its own standard error.

    Without scaling, parameters as different as a time constant in hours and a play in micrometres would make the matrix
    singular.
    """
    part = normal if free.all() else normal[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-300))
    return scale[:, None] * part * scale, scale


SCANS = ((0.06, 241), (0.012, 13), (0.003, 13), (0.0006, 25))
"""Relative half-widths, and numbers of values, of the scans of a parameter on which the prediction depends
discontinuously. The first scan is for a thorough search: with a thousand jumps in a record, the basin of the right size
is only some ten-thousandths wide."""
MANY_STEPS = 20
"""Most iterations of a thorough fit; from a signature's start, Levenberg-Marquardt needs five to twelve."""


@dataclass(frozen=True, slots=True, eq=False)
class _JointSquares:
    """Chi-square as a function of some effects' parameters, with run offsets fitted.

    Parameters
    ----------
    problem : Problem
        Data and observation model.
    aim : ndarray of float, shape (m,)
        Whitened target.
    order : tuple of str
        Names of the effects, in the order of the measuring chain.
    listed : list of (str, Parameter)
        Parameters of the effects, with the bounds narrowed by the data.
    metric : ndarray of float
        Metric that accounts for the run offsets.
    sigma_mm : tuple of float or None
        Fixed spread of the run offsets; None to estimate it from the residual.
    latest : dict of bytes to ndarray
        Last prediction, by its parameters: the next derivatives are computed at the accepted step.
    """

    problem: Problem
    aim: Array
    order: tuple[str, ...]
    listed: list[tuple[str, Parameter]]
    metric: Array
    sigma_mm: tuple[float, ...] | None
    latest: dict[bytes, Array] = field(default_factory=dict)

    def settings(self, x: Array) -> Point:
        """Parameter values by name, from a vector of shape (p,)."""
        out: Point = {name: {} for name in self.order}
        for (name, parameter), value in zip(self.listed, x, strict=True):
            out[name][parameter.name] = float(value)
        return {name: self.problem.effects[name].within(values) for name, values in out.items()}

    def point(self, values: Mapping[str, Mapping[str, float]]) -> Array:
        """Vector of the parameters, shape (p,), from their values by name; a start state without a value is zero."""
        return np.array([values[name].get(one.name, one.neutral or 0.0) for name, one in self.listed])

    def residual(self, x: Array) -> Array:
        """Whitened target minus prediction."""
        return self.aim - self.problem.whitener.one(self._predicted(x))

    def _predicted(self, x: Array) -> Array:
        """Prediction of the stacked channels before whitening, shape (m,)."""
        key = x.tobytes()
        if key not in self.latest:
            self.latest.clear()
            self.latest[key] = self.problem.chain.stacked(self.settings(x))
        return self.latest[key]

    def squared(self, residual: Array) -> float:
        """Chi-square of a residual with the best run offsets."""
        return self.problem.offsets.squared(residual, self.metric)

    def reweighted(self, residual: Array) -> "_JointSquares":
        """Adapt the standard deviation of the run offsets to the residual, unless it is fixed."""
        offsets = self.problem.offsets
        spread = self.sigma_mm if self.sigma_mm is not None else offsets.spread(residual)[0]
        return replace(self, metric=offsets.metric(spread))

    def linearised(self, x: Array, residual: Array) -> tuple[Array, Array]:
        """Linearise the prediction by finite differences that stay within the bounds."""
        offsets = self.problem.offsets
        jacobian = self.problem.whitener.columns(self.derivatives(x))[0]
        shared = offsets.design.T @ jacobian
        normal = jacobian.T @ jacobian - shared.T @ self.metric @ shared
        pull = jacobian.T @ residual - shared.T @ self.metric @ (offsets.design.T @ residual)
        return normal, pull

    def derivatives(self, x: Array) -> Array:
        """Derivatives of the prediction before whitening, shape (m, p)."""
        problem = self.problem
        lower, upper = _bounds(self.listed)
        base = self._predicted(x)
        columns = np.empty((base.size, x.size))
        steps = np.maximum(1e-4 * np.abs(x), 1e-6 * np.minimum(upper - lower, 10.0 * np.abs(x) + 1e-2))
        for group in _together(self.listed):
            step = np.where(x[group] + steps[group] <= upper[group], steps[group], -steps[group])
            moved = x.copy()
            moved[group] += step
            change = problem.chain.stacked(self.settings(moved)) - base
            for i, by in zip(group, step, strict=True):
                columns[:, i] = problem.only_run(change, self.listed[i][1].run) / by
        return columns


def fit(
    problem: Problem,
    names: tuple[str, ...],
    start: Mapping[str, Mapping[str, float]],
    *,
    target: Array | None = None,
    sigma_mm: tuple[float, ...] | None = None,
    iterations: int = 12,
) -> Explanation:
    """Fit effects jointly, by a search within the bounds of their parameters.

    Parameters
    ----------
    problem : Problem
        Data and observation model.
    names : tuple of str
        Names of the effects; without any, the result is the model without effects.
    start : mapping
        Initial values of the parameters.
    target : ndarray of float, shape (m,), or None
        Whitened target; None for the measurement.
    sigma_mm : tuple of float or None
        Spread of the run offsets; None to estimate it.
    iterations : int
        Largest number of iterations.
    """
    if not names:
        return problem.nothing()
    aim = problem.measured if target is None else target
    order = tuple(name for name in problem.effects if name in names)
    listed = problem.parameters(order)
    lower, upper = _bounds(listed)
    squares = _JointSquares(problem, aim, order, listed, np.zeros((0, 0)), sigma_mm)
    at_ends = np.array([parameter.at_ends for _, parameter in listed])

    def leaving(curvature: Array) -> Array:
        # What one explanation can imitate of another one does not depend on the prior of its start states.
        return np.where(at_ends & (target is None), inner_price(curvature, problem.rows), 0.0)

    found = descend(squares, np.clip(squares.point(start), lower, upper), lower, upper, iterations, leaving)
    found = _scanned(found, lower, upper, thorough=iterations >= MANY_STEPS)
    spread, penalty, cost = sigma_mm, 0.0, found.cost
    if spread is None:
        spread, penalty = problem.offsets.spread(found.residual)
        cost = problem.offsets.squared(found.residual, problem.offsets.metric(spread))
    own = np.array([parameter.run is None for _, parameter in listed], dtype=bool)
    covariance = found.covariance()
    return Explanation(
        names=order,
        values=squares.settings(found.x),
        score=cost + penalty,
        residual=found.residual,
        covariance=covariance,
        free=int((found.free & own).sum()),
        sigma_mm=spread,
        starts_price=starts_price(listed, found.x, np.diag(found.normal), problem.rows),
        places_price=places_price(listed, covariance, problem.rows),
        rows=problem.rows,
    )


def derivatives(problem: Problem, explanation: Explanation) -> Array:
    """Derivatives of the prediction with respect to an explanation's parameters, before whitening; shape (m, p)."""
    listed = problem.parameters(explanation.names)
    squares = _JointSquares(problem, problem.measured, explanation.names, listed, np.zeros((0, 0)), None)
    return squares.derivatives(squares.point(explanation.values))


def refit(problem: Problem, explanation: Explanation) -> Explanation:
    """Fit the effects of an explanation thoroughly, from its own parameters."""
    return fit(problem, explanation.names, explanation.values, iterations=MANY_STEPS)


def _scanned(found: Descent[_JointSquares], lower: Array, upper: Array, *, thorough: bool) -> Descent[_JointSquares]:
    """Scan around the fitted values of parameters on which the prediction depends discontinuously."""
    x, residual, cost = found.x, found.residual, found.cost
    for i, (_, parameter) in enumerate(found.squares.listed):
        for width, count in SCANS[not thorough :] if parameter.rugged else ():
            for value in np.clip(x[i] * (1.0 + width * np.linspace(-1.0, 1.0, count)), lower[i], upper[i]):
                trial = x.copy()
                trial[i] = value
                rest = found.squares.residual(trial)
                new = found.squares.squared(rest)
                if new < cost:
                    x, residual, cost = trial, rest, new
    return replace(found, x=x, residual=residual, cost=cost)


def _bounds(listed: list[tuple[str, Parameter]]) -> tuple[Array, Array]:
    lower = np.array([parameter.lower for _, parameter in listed])
    return lower, np.array([parameter.upper for _, parameter in listed])


def _together(listed: list[tuple[str, Parameter]]) -> list[list[int]]:
    """Group parameters that share one prediction for their derivatives: start states of runs affect separate rows."""
    groups: dict[object, list[int]] = {}
    for i, (name, parameter) in enumerate(listed):
        groups.setdefault(i if parameter.run is None else name, []).append(i)
    return list(groups.values())


def scan(
    problem: Problem, base: Explanation, name: str, starts: Sequence[Mapping[str, float]]
) -> tuple[dict[str, float], float]:
    """Add one more effect to an explanation whose parameters stay fixed.

    Returns
    -------
    start : dict
        The best of the given `starts`.
    score : float
        Score with these parameters, without a refit.
    """
    predicted = [problem.chain.stacked({**base.values, name: start}) for start in starts]
    residual = problem.measured[:, None] - problem.whitener.columns(np.stack(predicted, axis=1))[0]
    shared = problem.offsets.design.T @ residual
    metric = problem.offsets.metric(base.sigma_mm)
    length = np.einsum("ij,ij->j", residual, residual) - np.einsum("ij,ij->j", shared, metric @ shared)
    best = int(np.argmin(length))
    before = problem.offsets.squared(base.residual, metric)
    return dict(starts[best]), base.score - before + float(length[best])

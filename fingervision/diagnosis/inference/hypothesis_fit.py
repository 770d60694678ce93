"""Fitting an explanation: effects inside the measuring chain, refitted jointly by generalised least squares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.noise.whitening import RunOffsets, Whitener
from fingervision.domain.effect import Array, Effect
from fingervision.domain.parameter import Parameter

Point = dict[str, dict[str, float]]
AT_BOUND = 1e-6
"""Share of a parameter's range within which it lies at its bound: rounding of the search."""
SCANS = ((0.06, 241), (0.012, 13), (0.003, 13), (0.0006, 25))
"""Relative half-widths, and values, of the scans of a parameter in which the prediction jumps. The first is for a
thorough search: with a thousand jumps in a record the right size has a basin some ten-thousandths wide."""
MANY_STEPS = 20
"""Steps of a thorough fit; Levenberg-Marquardt from a signature's start needs five to twelve."""
START_VARIANCE = 1.0 / 3.0
"""Variance of a start state that may be anywhere between -1 and 1."""
FORM_SHARE = 0.02
"""By how much of what an effect changes the catalogue's form of it is typically off."""
SMALL_SHARE = 0.05
"""What the catalogue's form leaves over of the truth's is a few per cent of what was explained, no second name."""


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    """Effects with their parameters, and how well they explain a target.

    Parameters
    ----------
    names : tuple of str
        Effects, in the order of the chain.
    values : mapping of str to mapping of str to float
        Estimates.
    score : float
        Chi-square with run offsets allowed for, plus the offsets' own penalty.
    residual : ndarray of float, shape (m,)
        Whitened target minus prediction.
    covariance : ndarray of float, shape (p, p)
        Of the parameters in their order; zero rows for those at a bound.
    free : int
        Parameters of the effects that are not at a bound.
    sigma_mm : tuple of float
        Spread of the run offsets under this explanation, one a channel.
    starts_price : float
        Price of the fitted start states: twice the logarithm of prior width over posterior width, summed.
    """

    names: tuple[str, ...]
    values: Mapping[str, Mapping[str, float]]
    score: float
    residual: Array
    covariance: Array
    free: int
    sigma_mm: tuple[float, ...]
    starts_price: float = 0.0

    def bic(self, samples: int) -> float:
        """Schwarz's criterion: score plus the price of the free parameters and start states."""
        return self.score + self.free * float(np.log(samples)) + self.starts_price


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Everything an explanation is judged by.

    Parameters
    ----------
    chain : MeasuringChain
        Model and history.
    measured : ndarray of float, shape (m,)
        Whitened measurement, channels stacked.
    whitener, offsets
        The observation model.
    effects : mapping of str to Effect
        Those that the data can show.
    form_share : float
        Share of what is explained that the form of an effect may leave over, as a ratio of amplitudes.
    stalled : frozenset of str
        Effects for which readings that stand at an end of the range speak.
    mapped : float
        Squared whitened length of what a map of position errors explains beside every explanation; 0 without one.
    """

    chain: MeasuringChain
    measured: Array
    whitener: Whitener
    offsets: RunOffsets
    effects: Mapping[str, Effect]
    form_share: float = SMALL_SHARE
    stalled: frozenset[str] = frozenset()
    mapped: float = 0.0

    def parameters(self, names: tuple[str, ...]) -> list[tuple[str, Parameter]]:
        """List the parameters of some effects with the bounds that the data leave."""
        found: list[tuple[str, Parameter]] = []
        for name in names:
            searched = self.effects[name].search(self.whitener.history)
            found += [(name, parameter) for parameter in searched if not isinstance(parameter, str)]
        return found

    def only_run(self, column: Array, run: int | None) -> Array:
        """Keep the rows of one run of a column of shape (m,) or all where `run` is None."""
        if run is None or len(self.chain.history.runs) == 1:
            return column
        rows = self.chain.history.runs[run]
        n = self.chain.history.input_mm.size
        out = np.zeros_like(column)
        for begin in range(0, column.size, n):
            out[begin + rows.start : begin + rows.stop] = column[begin + rows.start : begin + rows.stop]
        return out

    def whitened(self, settings: Mapping[str, Mapping[str, float]]) -> Array:
        """Predict and whiten; shape (m,)."""
        return self.whitener.one(self.chain.stacked(settings))

    def score(self, settings: Mapping[str, Mapping[str, float]]) -> float:
        """Judge parameters as they are: chi-square with the best run offsets, plus those offsets' penalty."""
        residual = self.measured - self.whitened(settings)
        sigma, penalty = self.offsets.spread(residual)
        return self.offsets.squared(residual, self.offsets.metric(sigma)) + penalty

    def cost(self, settings: Mapping[str, Mapping[str, float]]) -> float:
        """-2 log of the posterior, up to a constant: the score over all spreads of the runs instead of at the best."""
        residual = self.measured - self.whitened(settings)
        sigma, penalty = self.offsets.spread(residual)
        metric = self.offsets.metric(sigma)
        return self.offsets.squared(residual, metric) + penalty + self.offsets.doubt(residual)

    def nothing(self) -> Explanation:
        """Judge the model as it is."""
        residual = self.measured - self.whitened({})
        sigma, penalty = self.offsets.spread(residual)
        score = self.offsets.squared(residual, self.offsets.metric(sigma)) + penalty
        return Explanation((), {}, score, residual, np.zeros((0, 0)), 0, sigma)


def fit(
    problem: Problem,
    names: tuple[str, ...],
    start: Mapping[str, Mapping[str, float]],
    *,
    target: Array | None = None,
    sigma_mm: tuple[float, ...] | None = None,
    iterations: int = 12,
) -> Explanation:
    """Fit effects jointly by a bounded Levenberg-Marquardt search (Marquardt 1963).

    Parameters
    ----------
    problem : Problem
        Data and observation model.
    names : tuple of str
        Effects.
    start : mapping
        Where to begin.
    target : ndarray of float, shape (m,), or None
        Whitened curve to explain; None for the measurement.
    sigma_mm : tuple of float or None
        Spread of run offsets; None to profile it.
    iterations : int
        Steps at most.
    """
    aim = problem.measured if target is None else target
    order = tuple(name for name in problem.effects if name in names)
    listed = problem.parameters(order)
    lower = np.array([parameter.lower for _, parameter in listed])
    upper = np.array([parameter.upper for _, parameter in listed])
    span = upper - lower
    x = np.array([start[name].get(parameter.name, parameter.neutral or 0.0) for name, parameter in listed])
    x = np.clip(x, lower, upper)
    together = _together(listed)
    offsets = problem.offsets

    def settings(at: Array) -> Point:
        out: Point = {name: {} for name in order}
        for (name, parameter), value in zip(listed, at, strict=True):
            out[name][parameter.name] = float(value)
        return out

    residual = aim - problem.whitened(settings(x))
    spread = sigma_mm if sigma_mm is not None else offsets.spread(residual)[0]
    metric = offsets.metric(spread)
    cost = offsets.squared(residual, metric)
    damping = 1e-3
    normal, free = np.zeros((x.size, x.size)), np.ones(x.size, dtype=bool)
    for step_number in range(iterations):
        base = problem.chain.stacked(settings(x))
        columns = np.empty((base.size, x.size))
        steps = np.maximum(1e-4 * np.abs(x), 1e-6 * np.minimum(span, 10.0 * np.abs(x) + 1e-2))
        for group in together:
            step = np.where(x[group] + steps[group] <= upper[group], steps[group], -steps[group])
            moved = x.copy()
            moved[group] += step
            change = problem.chain.stacked(settings(moved)) - base
            for i, by in zip(group, step, strict=True):
                columns[:, i] = problem.only_run(change, listed[i][1].run) / by
        jacobian = problem.whitener.columns(columns)[0]
        shared = offsets.design.T @ jacobian
        normal = jacobian.T @ jacobian - shared.T @ metric @ shared
        gradient = jacobian.T @ residual - shared.T @ metric @ (offsets.design.T @ residual)
        low, high = x <= lower + AT_BOUND * span, x >= upper - AT_BOUND * span
        free = ~((low & (gradient <= 0.0)) | (high & (gradient >= 0.0))) & (np.diag(normal) > 1e-12)
        if not free.any():
            break
        # In units of each parameter's own precision: a time constant in hours beside micrometres is no singular matrix.
        scale = 1.0 / np.sqrt(np.diag(normal)[free])
        part, pull = scale[:, None] * normal[np.ix_(free, free)] * scale, scale * gradient[free]
        gained = 0.0
        for _ in range(5):
            bounds = ((lower - x)[free] / scale, (upper - x)[free] / scale)
            trial = x.copy()
            trial[free] += scale * bounded_step(part + damping * np.eye(scale.size), pull, bounds)
            trial = np.clip(trial, lower, upper)
            rest = aim - problem.whitened(settings(trial))
            new = offsets.squared(rest, metric)
            if new < cost:
                gained = cost - new
                x, residual, cost, damping = trial, rest, new, max(damping / 10.0, 1e-7)
                break
            damping *= 8.0
        if sigma_mm is None and len(problem.chain.history.runs) > 1:
            spread = offsets.spread(residual)[0]
            metric = offsets.metric(spread)
            cost = offsets.squared(residual, metric)
        if gained < 0.02 + 1e-5 * cost and step_number > 0:
            break
    thorough = iterations >= MANY_STEPS
    for i, (_, parameter) in enumerate(listed):
        for width, count in SCANS[not thorough :] if parameter.rugged else ():
            for value in np.clip(x[i] * (1.0 + width * np.linspace(-1.0, 1.0, count)), lower[i], upper[i]):
                trial = x.copy()
                trial[i] = value
                rest = aim - problem.whitened(settings(trial))
                new = offsets.squared(rest, metric)
                if new < cost:
                    x, residual, cost = trial, rest, new
    penalty = 0.0
    if sigma_mm is None:
        spread, penalty = offsets.spread(residual)
        cost = offsets.squared(residual, offsets.metric(spread))
    covariance = np.zeros_like(normal)
    if free.any():
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal)[free], 1e-300))
        unit = scale[:, None] * normal[np.ix_(free, free)] * scale
        covariance[np.ix_(free, free)] = scale[:, None] * np.linalg.pinv(unit) * scale
    own = np.array([parameter.run is None for _, parameter in listed], dtype=bool)
    # A start is anywhere between -1 and 1 beforehand, with a variance of 1/3; one at its end was chosen as well.
    # It costs no more than a parameter does, or a play would be the greater surprise than two effects that imitate it.
    prices = np.log1p(np.diag(normal)[~own] * START_VARIANCE)
    price = float(np.sum(np.minimum(prices, np.log(max(2, aim.size)))))
    names_of = settings(x)
    return Explanation(order, names_of, cost + penalty, residual, covariance, int((free & own).sum()), spread, price)


def bounded_step(matrix: Array, pull: Array, bounds: tuple[Array, Array]) -> Array:
    """Minimise a quadratic form within bounds, to the accuracy that a step of a search needs.

    What would go beyond its bound is held there and the others are solved again beside it: clipped alone it would
    leave them where they suit a step that was never made.

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
    step, held = np.zeros(pull.size), np.zeros(pull.size, dtype=bool)
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


def _together(listed: list[tuple[str, Parameter]]) -> list[list[int]]:
    """Group parameters whose derivatives one prediction gives: starts of different runs touch different rows."""
    groups: dict[object, list[int]] = {}
    for i, (name, parameter) in enumerate(listed):
        groups.setdefault(i if parameter.run is None else name, []).append(i)
    return list(groups.values())


def scan(
    problem: Problem, base: Explanation, name: str, starts: Sequence[Mapping[str, float]]
) -> tuple[dict[str, float], float]:
    """Try one more effect beside an explanation as it stands.

    Returns
    -------
    start : dict
        The best of `starts`.
    score : float
        With it, without any refit.
    """
    predicted = [problem.chain.stacked({**base.values, name: start}) for start in starts]
    residual = problem.measured[:, None] - problem.whitener.columns(np.stack(predicted, axis=1))[0]
    shared = problem.offsets.design.T @ residual
    metric = problem.offsets.metric(base.sigma_mm)
    length = np.einsum("ij,ij->j", residual, residual) - np.einsum("ij,ij->j", shared, metric @ shared)
    best = int(np.argmin(length))
    before = problem.offsets.squared(base.residual, metric)
    return dict(starts[best]), base.score - before + float(length[best])

"""Draw the parameters of an explanation from their posterior distribution within the bounds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.inference.evidence import noise_doubt, odds
from fingervision.diagnosis.inference.hypothesis import FORM_SHARE, Explanation, Point, Problem
from fingervision.diagnosis.inference.parameter_priors import START_VARIANCE
from fingervision.domain.effect import Array, Effect
from fingervision.domain.parameter import Parameter

EVALUATED = 1e6
"""Largest number of samples predicted in one random walk: the likelihood of a long table is close to normal, so that
few steps suffice."""
LEAST_STEPS, MOST_STEPS = 200, 1200
"""Least and largest number of steps of a walk: with 200 steps, of which a quarter are independent, a standard deviation
is known to a tenth."""
LEARNT = 150
"""Number of steps after which the local walk takes its widths from the visited points (Haario, Saksman & Tamminen
2001)."""
FREEDOM = 5.0
"""Degrees of freedom of the independent proposals, whose tails must be longer than the posterior's."""
SCALES = (0.02, 0.1, 0.4, 1.2)
"""Step sizes of the local walk relative to the widths from the curvature: one of them is suitable if the curvature is
misleading."""
START_STEP = 1e-3
"""Step for the derivative with respect to a start state."""
JUMPS = 0.01
"""Initial relative width of the walk for parameters on which the prediction depends discontinuously."""


@dataclass(frozen=True, slots=True)
class _Coordinates:
    """Coordinates of the sampler: reciprocals of radii and periods, logarithms of times, other parameters unchanged.

    In the sampler's coordinates, a log likelihood with long, curved contours in the parameters is nearly parabolic.
    """

    listed: tuple[tuple[str, Parameter], ...]
    starts: Mapping[str, Mapping[str, float]]
    effects: Mapping[str, Effect]

    @classmethod
    def about(cls, problem: Problem, explanation: Explanation) -> "_Coordinates":
        """Coordinates of the parameters of the effects themselves; start states are fixed (see `beside_starts`)."""
        listed = problem.parameters(explanation.names)
        starts: dict[str, dict[str, float]] = {}
        for name, parameter in listed:
            if parameter.run is not None:
                starts.setdefault(name, {})[parameter.name] = explanation.values[name].get(parameter.name, 0.0)
        return cls(tuple(entry for entry in listed if entry[1].run is None), starts, problem.effects)

    def of(self, values: Mapping[str, Mapping[str, float]]) -> Array:
        """Convert parameters to the sampler's coordinates; shape (p,)."""
        return np.array([_forth(parameter, values[name][parameter.name]) for name, parameter in self.listed])

    def at(self, coordinates: Array) -> Point:
        """Convert the sampler's coordinates to parameters, clipped to the bounds."""
        out: Point = {name: dict(values) for name, values in self.starts.items()}
        for (name, parameter), x in zip(self.listed, coordinates, strict=True):
            value = _back(parameter, float(x))
            out.setdefault(name, {})[parameter.name] = float(np.clip(value, parameter.lower, parameter.upper))
        return {name: self.effects[name].within(values) for name, values in out.items()}

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds in the sampler's coordinates, each of shape (p,)."""
        ends = [sorted((_forth(p, p.lower), _forth(p, p.upper))) for _, p in self.listed]
        return np.array([low for low, _ in ends]), np.array([high for _, high in ends])


def _forth(parameter: Parameter, value: float) -> float:
    if parameter.lower > 0.0 and parameter.reciprocal:
        return 1.0 / value
    if parameter.lower > 0.0 and parameter.logarithmic:
        return float(np.log(value))
    return value


def _back(parameter: Parameter, x: float) -> float:
    if parameter.lower > 0.0 and parameter.reciprocal:
        return 1.0 / max(x, 1e-300)
    if parameter.lower > 0.0 and parameter.logarithmic:
        return float(np.exp(x))
    return x


def _curvature(problem: Problem, explanation: Explanation, walk: _Coordinates, best: Array, step: Array) -> Array:
    """Half of the second derivatives of the score, shape (p, p), from differences of the prediction over `step`."""
    upper = walk.bounds[1]
    base = problem.whitened(explanation.values)
    columns = []
    for i in range(best.size):
        moved = best.copy()
        moved[i] += step[i] if best[i] + step[i] <= upper[i] else -step[i]
        columns.append((problem.whitened(walk.at(moved)) - base) / (moved[i] - best[i]))
    jacobian = np.stack(columns, axis=1)
    shared = problem.offsets.design.T @ jacobian
    return np.asarray(jacobian.T @ jacobian - shared.T @ problem.offsets.metric(explanation.sigma_mm) @ shared)


def _widths(problem: Problem, explanation: Explanation, walk: _Coordinates, best: Array) -> Array:
    """Covariance from the curvature within the bounds, shape (p, p): the scale of the sampler's steps."""
    lower, upper = walk.bounds
    span = upper - lower
    rugged = np.array([parameter.rugged for _, parameter in walk.listed])
    step = np.maximum(1e-4 * np.abs(best), 1e-6 * span)
    covariance = np.diag(span**2)
    for _ in range(2):
        # Repeat the differences over the width found, because the prediction of a play is not smooth.
        scaled = span[:, None] * _curvature(problem, explanation, walk, best, step) * span
        # The width of the bounds is the prior; rounding may leave a curvature that is zero slightly below zero.
        values, axes = np.linalg.eigh(scaled)
        covariance = np.asarray((axes / (np.maximum(values, 0.0) + 1.0)) @ axes.T) * span[:, None] * span
        step = np.clip(np.sqrt(np.diag(covariance)), 1e-9 * span, 0.1 * span)
    # Parameters with jumps have no derivative: the walk starts with a width of a hundredth of the parameter.
    covariance[rugged] = 0.0
    covariance[:, rugged] = 0.0
    covariance[rugged, rugged] = (JUMPS * best[rugged]) ** 2
    return covariance


def draws(
    problem: Problem, explanation: Explanation, rng: np.random.Generator, most: int = MOST_STEPS
) -> tuple[Point, ...]:
    """Sample the posterior under flat priors within the bounds (Metropolis et al. 1953; Tierney 1994).

    The curvature at the best fit ignores bounds and non-parabolic likelihoods: a fraction estimated as zero is still
    uncertain, and the prediction has no derivative with respect to the size of a jump. Independent proposals from the
    curvature alternate with local steps of several sizes, so that parabolic and irregular posteriors are both explored.
    The spreads of the runs' offsets, and noise levels within `noise_doubt`, are sampled too, so that the posterior has
    Student's tails (Box & Tiao 1973). A walk has at most `most` steps.

    Returns
    -------
    tuple of dict
        Draws of the parameters, in the form of an explanation's `values`.
    """
    walk = _Coordinates.about(problem, explanation)
    best = walk.of(explanation.values)
    lower, upper = walk.bounds
    covariance = _widths(problem, explanation, walk, best)
    root = np.linalg.cholesky(covariance + 1e-12 * np.diag(np.diag(covariance)))
    inverse = np.linalg.inv(root)

    def far(at: Array) -> float:
        """Log density of the sampler's independent proposals, up to a constant."""
        z = inverse @ (at - best)
        return -0.5 * (FREEDOM + best.size) * float(np.log1p(z @ z / FREEDOM))

    # Integrated over the level of the noise, of which as many degrees of freedom are known, the posterior of each
    # parameter is Student's distribution with these degrees of freedom.
    level = 2.0 / noise_doubt(problem) ** 2
    least = problem.cost(explanation.values)

    def cost(at: Array) -> float:
        above = problem.cost(walk.at(at)) - least
        return (level + best.size) * float(np.log1p(max(above / level, -0.5)))

    now, score = best, 0.0
    kept: list[Array] = []
    local = root
    for count in range(int(np.clip(EVALUATED / problem.chain.history.input_mm.size, LEAST_STEPS, most))):
        ahead, alone = rng.standard_normal(best.size), bool(count % 2)
        if count and count % LEARNT == 0:
            seen = np.atleast_2d(np.cov(np.array(kept).T))
            local = np.linalg.cholesky(seen + 1e-4 * np.diag(np.diag(covariance)))
        if alone:
            trial = best + root @ ahead / np.sqrt(rng.chisquare(FREEDOM) / FREEDOM)
        else:
            trial = now + SCALES[int(rng.integers(len(SCALES)))] * 2.4 / np.sqrt(best.size) * (local @ ahead)
        luck = np.log(rng.random())
        if np.all(trial >= lower) and np.all(trial <= upper):
            new = cost(trial)
            if luck < 0.5 * (score - new) + (far(now) - far(trial) if alone else 0.0):
                now, score = trial, new
        kept.append(now)
    return tuple(walk.at(at) for at in kept)


def beside_starts(problem: Problem, explanation: Explanation) -> Problem:
    """Treat the start states of an explanation as random effects around their fitted values.

    A start state at a bound stays fixed, because values beyond the bound are impossible.
    """
    base = problem.chain.stacked(explanation.values)
    columns = []
    for name, parameter in problem.parameters(explanation.names):
        value = explanation.values[name].get(parameter.name, 0.0)
        if parameter.run is None or not parameter.lower < value < parameter.upper:
            continue
        step = START_STEP if value < 0.0 else -START_STEP
        moved = {**explanation.values, name: {**explanation.values[name], parameter.name: value + step}}
        columns.append((problem.chain.stacked(moved) - base) / step * np.sqrt(START_VARIANCE))
    if not columns:
        return problem
    return problem.beside(np.stack(columns, axis=1))


def settled(
    problem: Problem, explanation: Explanation, rng: np.random.Generator
) -> tuple[Explanation, tuple[Point, ...]]:
    """Give an explanation its posterior standard deviations, and parameters at a bound also the posterior mean.

    If the best fit lies at a bound, the posterior mean predicts better, because the data also allow values away from
    the bound.

    Returns
    -------
    explanation : Explanation
        Explanation whose covariance is the mean square of the draws about its values. Noise of relative size
        `FORM_SHARE` is added for the inexactness of an effect's formula, in as many independent shapes as the catalogue
        has. The size of a jump is not known better than the recorded input.
    found : tuple of dict
        The draws.
    """
    if not explanation.names:
        return explanation, ({},)
    problem = beside_starts(problem, explanation)
    found = draws(problem, explanation, rng)
    walk = _Coordinates.about(problem, explanation)
    values, score = explanation.values, explanation.score
    if explanation.free < len(walk.listed):
        middle = walk.at(np.mean([walk.of(point) for point in found], axis=0))
        worse = problem.judged(explanation, middle).score
        if worse - score < len(walk.listed):
            values, score = middle, worse
    rows = [[point[name][p.name] - values[name][p.name] for name, p in walk.listed] for point in found]
    away = np.array(rows)
    residual = problem.measured - problem.whitened(values)
    covariance = away.T @ away / len(found)
    explained = max(0.0, problem.cost({}) - problem.cost(values))
    covariance *= 1.0 + FORM_SHARE**2 * explained / len(problem.effects)
    rugged = np.array([parameter.rugged for _, parameter in walk.listed])
    covariance[rugged, rugged] += problem.chain.history.input_sigma_mm**2
    return replace(explanation, values=values, score=score, residual=residual, covariance=covariance), found


def beside_alternatives(problem: Problem, best: Explanation, alternatives: Sequence[Explanation]) -> Explanation:
    """Add the differences between indistinguishable explanations to the covariance of the best (Hoeting et al. 1999).

    A play of 40 um behind an input scale that is 2 % off is a play of 40.8 um in front of a lever ratio that is 2 %
    off: both predict the same gap, and either may be true.

    Parameters
    ----------
    problem : Problem
        Estimation problem.
    best : Explanation
        The best explanation.
    alternatives : sequence of Explanation
        The ambiguity set. Explanations without an effect do not count for the parameters of this effect.
    """
    own = [(name, parameter.name) for name, parameter in problem.parameters(best.names) if parameter.run is None]
    others = [e for e in alternatives if e.names and e.names != best.names]
    if not own or not others:
        return best
    # The noise, and the path, may have been estimated anew since the alternatives were fitted.
    against = np.array([odds(problem, problem.judged(e, e.values)) for e in (best, *others)])
    has = np.array([[name in e.names for name, _ in own] for e in (best, *others)])
    # Of each parameter, among the explanations that have it, whose odds may all be small against another one's.
    against = np.where(has, against[:, None], np.inf)
    weights = np.exp(-0.5 * (against - against.min(axis=0)))
    away = [[e.values[n][p] - best.values[n][p] if n in e.names else 0.0 for n, p in own] for e in others]
    apart = np.array(away) * np.sqrt(weights[1:] / weights.sum(axis=0))
    return replace(best, covariance=best.covariance + apart.T @ apart)

"""Places at which the stage turned between two rows, estimated from the gap together with an explanation."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import derivatives, fit, refit
from fingervision.diagnosis.inference.random_effect import LEAST_GAIN
from fingervision.diagnosis.inference.search import Look, Searched, problem_of, refitted
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.domain.effect import Array, Flags

MOST_STEPS = 8
"""Most linearised steps for the places: the gap depends on them nearly linearly, up to the row that a play reaches."""
NEXT_FIT = 7
"""Most iterations of the fit after each step: it begins at the fit before, which is near."""
SETTLED = 0.02
"""Change of the places, as a share of their range, below which they are final."""
TO_SD = 1.4826
"""Standard deviation of a normal distribution per median deviation from its mean."""
MOST_SEARCHES = 2
"""Most searches along other turning points: the second one follows an effect that only the first one could find."""
ALTERNATIVES = 3
"""Number of single effects with memory, or delays, for which the places are estimated besides the best explanation."""


@dataclass(frozen=True, slots=True, eq=False)
class Turned:
    """An explanation along a path with certain turning points.

    Parameters
    ----------
    data : Observations
        The observations along this path.
    problem : Problem
        Estimation problem along this path.
    explanation : Explanation
        The explanation, fitted along this path.
    price : float
        Price of the places: their distances from the prior's mean and, if they are estimated, the logarithm of the
        volume that the gap admits, as a share of the prior's (Laplace's approximation).
    """

    data: Observations
    problem: Problem
    explanation: Explanation
    price: float


def beside_turns(state: Searched, look: Look) -> Searched:
    """Search along the turning points that explain the gap best, if they explain it clearly better.

    On strokes at constant speed a play is the same as a delay but for the few rows after each reversal, which a search
    that judges by the residual of the delay takes for outliers or for noise. An effect with memory is therefore also
    added to the best explanation here.

    Parameters
    ----------
    state : Searched
        Search along a stage that turned where its motions before and after each reversal meet.
    look : Look
        Settings of searches.
    """
    if not state.data.turns.corners:
        return state
    for _ in range(MOST_SEARCHES):
        likelier = _likelier(state.data, state.found)
        if likelier is None:
            break
        state = look.again(likelier.data, likelier.explanation)
    if not (state.data.turns.uncertain and state.found.best.names):
        return state
    # What the places leave uncertain belongs to the uncertainty of the effects.
    state = replace(state, data=replace(state.data, turns=replace(state.data.turns, random=True)))
    return refitted(state)


def _likelier(data: Observations, found: Findings) -> Turned | None:
    """Find the explanation and turning points that are clearly likelier than the best along the path as it is.

    All are judged by the least noise that any of them leaves, and by every row that any of them explains.
    """
    tried = [Turned(data, problem_of(data, e), e, data.turns.price) for e in _depending(data, found)]
    if not tried:
        return None
    if data.turns.uncertain:
        tried += [_turned(data, each.explanation) for each in tried]
    least = min((each.problem for each in tried), key=lambda problem: problem.whitener.noises[0].total_mm)
    aside = np.all([each.problem.whitener.aside for each in tried], axis=0)
    judge = least.judged_by(replace(least.whitener, aside=aside), data.aim_mm)

    def cost(each: Turned) -> float:
        problem = replace(judge, chain=each.data.chain)
        return refit(problem, each.explanation).bic + each.price

    costs = [cost(each) for each in tried]
    now = costs[0] if found.best.names else judge.nothing().score + data.turns.price
    best = int(np.argmin(costs))
    return tried[best] if costs[best] < now - LEAST_GAIN else None


def _depending(data: Observations, found: Findings) -> list[Explanation]:
    """Explanations whose prediction can depend on where the stage turned.

    These are the best, the likeliest single effects, and the best with each of these added, unless the rows that do not
    depend on it refute them.
    """
    effects, best = found.problem.effects, found.best
    single = [e for e in found.singles if effects[e.names[0]].memory or effects[e.names[0]].delay_s is not None]
    single = sorted((e for e in single if e.names != best.names), key=lambda e: e.score)[:ALTERNATIVES]
    tried = [best, *single] if best.names else single
    for one in single:
        if best.names and one.names[0] not in best.names:
            names = tuple(name for name in effects if name in {*best.names, *one.names})
            tried.append(fit(found.problem, names, {**best.values, **one.values}, iterations=20))
    return [e for e in tried if e is best or not _refuted(data, found, e)]


def _refuted(data: Observations, found: Findings, explanation: Explanation) -> bool:
    """Whether an explanation leaves more in the rows that show no place than the best one leaves in all rows."""
    problem = found.problem
    whitener = replace(problem.whitener, aside=problem.whitener.aside | _shown(data, explanation))
    rest = problem.judged_by(whitener, data.aim_mm)
    return fit(rest, explanation.names, explanation.values, iterations=NEXT_FIT).score > found.best.score


def _shown(data: Observations, explanation: Explanation) -> Flags:
    """Rows of the stacked channels whose prediction depends on where the stage turned; shape (m,)."""
    return np.asarray(np.any(data.turn_columns_mm(explanation.values) != 0.0, axis=1))


def _turned(data: Observations, explanation: Explanation) -> Turned:
    """Estimate the places with an explanation, from those of the data, or from a stage that turned at the rows."""
    at_the_rows = data.turned(data.turns.ranges[:, 1])
    tried = [_settled(begin, explanation) for begin in (data, at_the_rows)]
    return min(tried, key=lambda turned: turned.explanation.score * turned.problem.whitener.noises[0].total_mm ** 2)


def _settled(data: Observations, explanation: Explanation) -> Turned:
    """Estimate the places step by step, jointly with the parameters of an explanation."""
    for _ in range(MOST_STEPS):
        problem = _beside_reversals(data, explanation)
        explanation = fit(problem, explanation.names, explanation.values, iterations=NEXT_FIT)
        short_by = np.array(data.turns.short_by)
        information, pull = _normal_equations(data, problem, explanation)
        root = np.linalg.cholesky(information)
        low, high = data.turns.ranges.T
        change = lsq_linear(root.T, np.linalg.solve(root, pull), (low - short_by - 1e-9, high - short_by + 1e-9)).x
        data = data.turned(np.clip(short_by + change, low, high))
        if np.max(np.abs(change) / (high - low)) < SETTLED:
            break
    problem = problem_of(data, explanation)
    explanation = refit(problem, explanation)
    information, _ = _normal_equations(data, problem, explanation)
    volume = float(np.linalg.slogdet(information * np.outer(data.turns.sigmas, data.turns.sigmas))[1])
    return Turned(data, problem, explanation, data.turns.price + volume)


def _beside_reversals(data: Observations, explanation: Explanation) -> Problem:
    """Estimation problem in which rows that depend on the places are no outliers.

    Its noise is white, with the median deviation of all other rows: the errors of the path are no noise.
    """
    values = explanation.values
    parts = np.split(data.stacked_mm - data.chain.stacked(values), len(data.channels))
    shows = _shown(data, explanation)
    aside = [
        out & ~own for out, own in zip(data.outliers(parts, explained=True), np.split(shows, len(parts)), strict=True)
    ]
    elsewhere = ~shows[: parts[0].size]
    noises = tuple(
        Noise(max(TO_SD * float(np.median(np.abs(part[elsewhere]))) if elsewhere.any() else 0.0, floor, 1e-9), 0.0, 0.0)
        for part, floor in zip(parts, data.floors_mm, strict=True)
    )
    return data.judged_by(noises, aside, values)


def _normal_equations(data: Observations, problem: Problem, explanation: Explanation) -> tuple[Array, Array]:
    """Normal equations for a change of the places, with the parameters and the runs' offsets refitted."""
    places = problem.whitener.columns(data.turn_columns_mm(explanation.values))[0]
    values = problem.whitener.columns(derivatives(problem, explanation))[0]
    offsets, metric = problem.offsets, problem.offsets.metric(explanation.sigma_mm)
    every = np.hstack([places, values, explanation.residual[:, None]])
    beside = offsets.beside(every, metric)
    count, normal = places.shape[1], every.T @ beside
    own, cross, rest = normal[:count, :count], normal[:count, count:-1], normal[count:-1, count:-1]
    removed = cross @ np.linalg.pinv(rest, rcond=1e-12, hermitian=True)
    known = 1.0 / data.turns.sigmas**2
    information = own - removed @ cross.T + np.diag(known)
    nearest = np.array(data.turns.short_by) - data.turns.ranges[:, 0]
    pull = normal[:count, -1] - removed @ normal[count:-1, -1] - known * nearest
    return 0.5 * (information + information.T), pull

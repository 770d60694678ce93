"""Least-squares fits of catalogue effects to a curve without noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tests.benchmarks.hidden.candidates import Candidate
from tests.benchmarks.hidden.catalogue_chain import (
    CREEP_START,
    WITH_START,
    Effects,
    Samples,
    Simulated,
    respond,
    without_starts,
)
from tests.benchmarks.hidden.weights import Weights

Array = NDArray[np.float64]
Curve = tuple[Array, Array, Array]
"""Curve of an experiment: gap, midline and force at the samples."""
STEP = 1e-4
AT_AN_END = 0.97
"""Start state that is tried: near an end of its range, but inside."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Best fit of effects, including start states of the runs, with its squared distance."""

    names: tuple[str, ...]
    effects: Effects
    distance: float

    @property
    def alone(self) -> Effects:
        """Effects without the start states of the runs."""
        return without_starts(self.effects)


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """An estimation problem: a simulation at samples, with weights."""

    model: Simulated
    at: Samples
    weights: Weights

    def residual(self, target: Curve, effects: Effects) -> Array:
        """Whitened difference between the effects' response and a curve."""
        answer = respond(self.model, self.at, effects)
        return self.weights.apply(*(a - b for a, b in zip(answer, target, strict=True)))

    def distance(self, target: Curve, effects: Effects) -> float:
        """Squared whitened distance between the effects' response and a curve."""
        r = self.residual(target, effects)
        return float(r @ r)


def fit(
    problem: Problem,
    target: Curve,
    chosen: list[Candidate],
    start: list[Array],
    evaluations: int = 60,
    *,
    begun: Effects | None = None,
    creep_starts: bool = False,
) -> Fit:
    """Fit the parameters of all given effects jointly in the chain, from one set of starting values.

    Start states of the runs are fitted too: always for plays and sliders, and for creep if `creep_starts` is True.
    `begun` may contain initial start states. After the search, each run's start state is tried at both ends and in the
    middle, and the search continues from any better state.
    """
    left = frozenset[str]() if creep_starts else frozenset({CREEP_START})
    keys = sorted({WITH_START[c.name] for c in chosen if c.name in WITH_START} - left)
    runs = len(problem.at.starts) - 1
    before = begun or {}
    first = {key: before.get(key, np.zeros(runs)) for key in keys}
    found = _search(problem, target, chosen, start, first, evaluations)
    for key in keys:
        tried = dict(found.effects)
        least = found.distance
        for run in range(runs):
            for place in (-AT_AN_END, 0.0, AT_AN_END):
                moved = tried[key].copy()
                moved[run] = place
                distance = problem.distance(target, tried | {key: moved})
                if distance < least:
                    least, tried = distance, tried | {key: moved}
        if least < found.distance - 0.5:
            begin = [tried[c.name] for c in chosen]
            found = _search(problem, target, chosen, begin, {k: tried[k] for k in keys}, evaluations)
    return found


def _search(
    problem: Problem, target: Curve, chosen: list[Candidate], start: list[Array], starts: Effects, evaluations: int
) -> Fit:
    """Least squares over the parameters of given effects and the start states of the runs."""
    count = sum(len(c.lower) for c in chosen)
    nuisances = sum(values.size for values in starts.values())
    sizes = [len(c.lower) for c in chosen] + [values.size for values in starts.values()]
    cuts = np.cumsum(sizes)[:-1]
    lower = np.concatenate([*(c.lower for c in chosen), -np.ones(nuisances)])
    upper = np.concatenate([*(c.upper for c in chosen), np.ones(nuisances)])
    names = tuple(c.name for c in chosen)
    labels = (*names, *starts)
    begin = np.concatenate([*start, *starts.values()])
    scale = np.maximum(np.abs(begin), 1e-3 * (upper - lower))
    scale[count:] = 1.0
    scale = np.minimum(scale, upper - lower)

    def effects_of(z: Array) -> Effects:
        return dict(zip(labels, np.split(np.clip(z * scale, lower, upper), cuts), strict=True))

    inside = np.clip(begin, lower + 1e-6 * (upper - lower), upper - 1e-6 * (upper - lower)) / scale
    # The influence of a start state is proportional to the play, so that a step of 1e-3 of its range is smooth enough.
    share = np.where(np.arange(begin.size) < count, STEP, 10 * STEP)

    def jacobian(z: Array) -> Array:
        # Difference steps are shares of the starting value, not of the present value; otherwise a search would stop at
        # zero.
        base = problem.residual(target, effects_of(z))
        steps = share * np.maximum(1.0, np.abs(z))
        steps = np.where(z + steps > upper / scale, -steps, steps)
        moved = (z + step * axis for step, axis in zip(steps, np.eye(z.size), strict=True))
        return np.stack([problem.residual(target, effects_of(at)) - base for at in moved], axis=1) / steps

    done = least_squares(
        lambda z: problem.residual(target, effects_of(z)),
        inside,
        jac=jacobian,
        bounds=(lower / scale, upper / scale),
        max_nfev=evaluations,
        xtol=1e-7,
        ftol=1e-7,
    )
    return Fit(names, effects_of(done.x), float(2 * done.cost))

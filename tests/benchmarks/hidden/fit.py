"""Least squares of effects of the catalogue to a curve without noise, and linear bounds on what they can reach."""

from dataclasses import dataclass

import numpy as np
from numba import njit
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
"""Gap, midline and force at the samples."""
STEP = 1e-4
AT_AN_END = 0.97
"""A start that is tried: at an end of its room, and yet inside."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Effects at their best, the starts of the runs among them, and how far they stay away."""

    names: tuple[str, ...]
    effects: Effects
    distance: float

    @property
    def alone(self) -> Effects:
        """The effects without the starts of the runs."""
        return without_starts(self.effects)


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What the judge fits: a simulation at samples, under weights."""

    model: Simulated
    at: Samples
    weights: Weights

    def residual(self, target: Curve, effects: Effects) -> Array:
        """Whitened difference between the effects' response and a curve."""
        answer = respond(self.model, self.at, effects)
        return self.weights.apply(*(a - b for a, b in zip(answer, target, strict=True)))

    def distance(self, target: Curve, effects: Effects) -> float:
        """Squared whitened distance."""
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
    """Best parameters of all chosen effects together, inside the chain, from one start.

    Where the runs start is fitted along: for plays and sliders always, for creep where `creep_starts` says so. `begun`
    may hold starts to begin with. After the search each run's start is tried at both ends and in the middle, and the
    search goes on from there where that is better.
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
    """Least squares over the parameters of the chosen effects and the starts of the runs."""
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
    # A start moves the curve in proportion to the play: a step of 1e-3 of its room is no less smooth.
    share = np.where(np.arange(begin.size) < count, STEP, 10 * STEP)

    def jacobian(z: Array) -> Array:
        # Steps are shares of the start, not of where the search is: a search that crosses zero would stand still there.
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


@dataclass(frozen=True, slots=True, eq=False)
class Library:
    """Linear signatures of every candidate at every shape, and the Gram matrix between them.

    Parameters
    ----------
    owner : ndarray of int, shape (groups,)
        Candidate of each group of columns.
    starts : tuple of tuple of int
        The candidate's starts that a group holds.
    first, size : ndarray of int, shape (groups,)
        Columns of a group: `size` of them from `first` on.
    gram : ndarray, shape (columns, columns)
    columns : ndarray, shape (m, columns)
        Of unit length.
    lengths : ndarray, shape (columns,)
        Length of each column before.
    """

    owner: NDArray[np.int64]
    starts: tuple[tuple[int, ...], ...]
    first: NDArray[np.int64]
    size: NDArray[np.int64]
    gram: Array
    columns: Array
    lengths: Array

    @classmethod
    def of(cls, problem: Problem, known: list[Candidate]) -> "Library":
        """Evaluate the chain once per start of each candidate."""
        bare = respond(problem.model, problem.at, {})
        columns, owner, first, size, starts = [], [], [], [], []
        for j, candidate in enumerate(known):
            base = len(columns)
            columns += [problem.residual(bare, {candidate.name: start}) for start in candidate.starts]
            for group in candidate.groups:
                owner.append(j)
                first.append(base + group[0])
                size.append(len(group))
                starts.append(group)
        matrix = np.array(columns).T
        lengths = np.sqrt(np.sum(matrix**2, axis=0))
        lengths = np.where(lengths > 1e-9, lengths, np.inf)
        matrix = matrix / lengths
        return cls(np.array(owner), tuple(starts), np.array(first), np.array(size), matrix.T @ matrix, matrix, lengths)

    def left_over(self, signal: Array, together: int) -> list[tuple[float, tuple[int, ...]]]:
        """Linear rest of each candidate (together 1) or pair (2) with the groups that reach it, smallest first."""
        reach = self.columns.T @ signal
        rests = _rests(self.gram, reach, float(signal @ signal), self.first, self.size, together == 2)
        best: dict[tuple[int, ...], tuple[float, tuple[int, ...]]] = {}
        places = np.argwhere(np.isfinite(rests))
        for a, b in places[np.argsort(rests[tuple(places.T)])]:
            key = (int(self.owner[a]),) if together == 1 else (int(self.owner[a]), int(self.owner[b]))
            if len(set(key)) == together and key not in best:
                best[key] = (float(rests[a, b]), (int(a),) if together == 1 else (int(a), int(b)))
        return list(best.values())

    def begin(self, known: list[Candidate], groups: tuple[int, ...], signal: Array) -> list[Array]:
        """Parameters at which the linear picture would begin a nonlinear fit, one array a group."""
        index = np.concatenate([np.arange(self.first[g], self.first[g] + self.size[g]) for g in groups])
        gram = self.gram[np.ix_(index, index)] + 1e-6 * np.eye(len(index))
        weights = np.linalg.solve(gram, self.columns[:, index].T @ signal) / self.lengths[index]
        out = []
        for g in groups:
            share, weights = weights[: self.size[g]], weights[self.size[g] :]
            candidate = known[self.owner[g]]
            out.append(enlarged(candidate, [candidate.starts[k] for k in self.starts[g]], share))
        return out


def enlarged(candidate: Candidate, starts: list[Array], share: Array) -> Array:
    """Small starts multiplied by what the linear picture says, within the bounds."""
    match candidate.name:
        case "encoder_cyclic_error":
            amplitude = starts[0][0] * np.hypot(*share)
            begin = np.array([amplitude, starts[0][1], np.arctan2(share[1], share[0])])
        case "viscoelastic_creep":
            begin = np.array(starts).T @ np.maximum(share, 0.02)
        case "large_deflection":
            cube = sum(w / s[0] ** 2 for w, s in zip(share, starts, strict=True))
            square = sum(w * s[1] / s[0] for w, s in zip(share, starts, strict=True))
            reach = 1 / np.sqrt(max(cube, 1e-6))
            begin = np.array([reach, square * reach])
        case "finger_contact":
            begin = np.array([starts[0][0], 1 - 0.8 * share[0]])
        case "position_error_map":
            begin = np.array(starts).T @ share
        case "slew_limit" | "backlash" | "stick_slip" | "end_stop" | "structural_resonance":
            begin = starts[0]
        case _:
            begin = starts[0].copy()
            begin[0] *= share[0]
    return np.clip(begin, candidate.lower, candidate.upper)


@njit(cache=True)
def _rests(
    gram: Array, reach: Array, total: float, first: NDArray[np.int64], size: NDArray[np.int64], pairs: bool
) -> Array:
    count = first.size
    out = np.full((count, count), np.inf)
    for a in range(count):
        for b in range(a, count):
            if (b == a) == pairs:
                continue
            second = size[b] if pairs else 0
            n = size[a] + second
            index = np.empty(n, dtype=np.int64)
            for i in range(size[a]):
                index[i] = first[a] + i
            for i in range(second):
                index[size[a] + i] = first[b] + i
            g = np.empty((n, n))
            c = np.empty(n)
            for i in range(n):
                c[i] = reach[index[i]]
                for j in range(n):
                    g[i, j] = gram[index[i], index[j]] + (1e-9 if i == j else 0.0)
            out[a, b] = max(total - np.dot(c, np.linalg.solve(g, c)), 0.0)
    return out

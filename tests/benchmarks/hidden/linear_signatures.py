"""Linear signatures of every effect at every starting value, and bounds of their fits."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.benchmarks.hidden.candidates import Candidate
from tests.benchmarks.hidden.catalogue_chain import respond
from tests.benchmarks.hidden.fit import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Library:
    """Linear signatures of every candidate at every starting value, with their Gram matrix.

    Parameters
    ----------
    owner : ndarray of int, shape (groups,)
        Number of the candidate to which each group of columns belongs.
    starts : tuple of tuple of int
        Starting values of the candidate in each group.
    first, size : ndarray of int, shape (groups,)
        First column and number of columns of each group.
    gram : ndarray, shape (columns, columns)
    columns : ndarray, shape (m, columns)
        Signatures, scaled to unit length.
    lengths : ndarray, shape (columns,)
        Length of each column before scaling.
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
        """Evaluate the chain once for each starting value of each candidate."""
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
        """Linear residual of each candidate (`together` 1) or pair (2) with its groups, smallest first."""
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
        """Starting values of a nonlinear fit from the linear fit, one array per group."""
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
    """Starting values multiplied by the coefficients of the linear fit, within the bounds."""
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

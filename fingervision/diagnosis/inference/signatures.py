"""Signatures: change of the prediction by each effect at each of its starting values."""

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import derivatives
from fingervision.diagnosis.noise.run_offsets import WhitenedColumns
from fingervision.domain.effect import Array, Flags, History, start_key

START_MOVES = 1e-3
"""Least size of a first motion, as a share of the range, that determines from which side a run starts."""


SAME_SIZE = (0.2, 3.0)
"""Range of the fitted coefficient in which a column without an amplitude still means its own size. Beyond this range, a
neighbouring size of the grid, a factor of two to three away, describes the residual better."""
BEYOND_BOUNDS = 0.3
"""Share of a parameter's range by which a linear estimate may exceed it: the refit, which is not linear, may come back
within the bounds."""


@dataclass(frozen=True, slots=True, eq=False)
class Signatures:
    """Whitened signatures as columns, with the parameters that produced each of them.

    Parameters
    ----------
    names : tuple of str, length k
        Name of the effect of each column.
    starts : tuple of dict, length k
        Parameters of each column.
    grows : tuple of (str, float, float) or None, length k
        Parameter that scales the column nearly linearly, with its neutral value and step; None if there is none.
    columns : WhitenedColumns
        Whitened differences from the model without the effect.
    """

    names: tuple[str, ...]
    starts: tuple[dict[str, float], ...]
    grows: tuple[tuple[str, float, float, float, float] | None, ...]
    columns: WhitenedColumns

    def gains(self, beside: Explanation, along: Array) -> tuple[Array, Array]:
        """Reduction of chi-square by each column alone in an explanation's residual, and its coefficient; shape (k,).

        Parameters
        ----------
        beside : Explanation
            The explanation.
        along : ndarray of float, shape (m, p)
            Columns that are refitted at the same time and projected out.
        """
        metric = self.columns.offsets.metric(beside.sigma_mm)
        dot, norm = self.columns.against(beside.residual, metric, along)
        usable = norm > 1e-6 * np.maximum(self.columns.lengths(metric), 1e-12)
        coefficient = np.where(usable, dot / np.where(usable, norm, 1.0), 0.0)
        allowed = self._in_bounds(coefficient) & usable
        return np.where(allowed, coefficient * dot, 0.0), coefficient

    def _in_bounds(self, coefficient: Array) -> Flags:
        out = np.zeros(coefficient.size, dtype=bool)
        for i, grow in enumerate(self.grows):
            if grow is None:
                out[i] = SAME_SIZE[0] < coefficient[i] < SAME_SIZE[1]
            else:
                _, neutral, step, lower, upper = grow
                value = neutral + coefficient[i] * step
                room = BEYOND_BOUNDS * (upper - lower)
                out[i] = lower - room <= value <= upper + room and (lower < neutral or value >= neutral)
        return out

    def begin(self, index: int, coefficient: float) -> dict[str, float]:
        """Parameters from which a search starts; the amplitude is scaled by the fitted coefficient of the signature."""
        start, grow = dict(self.starts[index]), self.grows[index]
        if grow is not None:
            name, neutral, step, lower, upper = grow
            start[name] = float(np.clip(neutral + coefficient * step, lower, upper))
        return start


Grow = tuple[str, float, float, float, float] | None
"""Parameter that scales a column nearly linearly: name, neutral value, step, bounds; None if there is none."""


class Changes(NamedTuple):
    """Changes of the prediction, before whitening, that become signatures; the fields are those of `Signatures`."""

    names: tuple[str, ...]
    starts: tuple[dict[str, float], ...]
    grows: tuple[Grow, ...]
    columns_mm: Array

    def whitened(self, problem: Problem) -> Signatures:
        """Signatures for the noise of a problem."""
        columns = WhitenedColumns(problem.whitener.columns(self.columns_mm)[0], problem.offsets)
        return Signatures(self.names, self.starts, self.grows, columns)


def signatures(problem: Problem) -> Signatures:
    """Compute the signatures: every effect at each of its starting values, in the complete measuring chain."""
    return changes(problem).whitened(problem)


def changes(problem: Problem) -> Changes:
    """Change of the prediction by every effect at each of its starting values."""
    bare = problem.chain.stacked({})
    names, starts, grows, columns = [], [], [], []
    for name in problem.effects:
        listed = [parameter for _, parameter in problem.parameters((name,)) if parameter.run is None]
        shapes = [p for p in listed if p.neutral is None]
        amplitudes = [p for p in listed if p.neutral is not None]
        for shape in product(*(p.starting_values() for p in shapes)):
            fixed = {p.name: float(value) for p, value in zip(shapes, shape, strict=True)}
            fixed |= {p.name: float(p.neutral) for p in amplitudes if p.neutral is not None}
            tried: list[tuple[dict[str, float], Grow]] = [(fixed, None)]
            for p in amplitudes:
                for value in p.starting_values():
                    neutral = float(p.neutral) if p.neutral is not None else 0.0
                    linear = (p.name, neutral, float(value) - neutral, p.lower, p.upper) if p.starts == 1 else None
                    tried.append(({**fixed, p.name: float(value)}, linear))
            begins = start_patterns(problem.chain.history) if problem.effects[name].start else ({},)
            for (start, grow), begin in product(tried, begins):
                start = {**start, **begin}
                column = problem.chain.stacked({name: start}) - bare
                if np.max(np.abs(column)) > 1e-12:
                    names.append(name)
                    starts.append(start)
                    grows.append(grow)
                    columns.append(column)
    return Changes(tuple(names), tuple(starts), tuple(grows), np.stack(columns, axis=1))


def start_patterns(history: History) -> tuple[dict[str, float], ...]:
    """Start states from which to search: the middle of the play, the end left by the first motion, the other end."""
    first = []
    for run in history.runs:
        moves = np.diff(history.input_mm[run])
        moving = moves[np.abs(moves) > START_MOVES * history.input_span_mm]
        first.append(float(np.sign(moving[0])) if moving.size else 1.0)
    return tuple({start_key(run): end * way for run, way in enumerate(first)} for end in (0.0, -1.0, 1.0))


def tangents(problem: Problem, explanation: Explanation) -> Array:
    """Derivatives of the whitened prediction with respect to parameters, scaled to unit length; shape (m, p)."""
    whitened = problem.whitener.columns(derivatives(problem, explanation))[0]
    return np.asarray(whitened / np.maximum(np.linalg.norm(whitened, axis=0), 1e-300))

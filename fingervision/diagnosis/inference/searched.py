"""Result of a completed search, and the settings of searches."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from fingervision.diagnosis.inference.explanation_candidates import Progress
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.reference_gauge import consistent_with_gauges
from fingervision.diagnosis.inference.search import Findings, search
from fingervision.diagnosis.input.observations import Observations


def problem_of(data: Observations, explanation: Explanation | None) -> Problem:
    """Estimation problem with the noise from an explanation's residual, or from the disagreement if there is none."""
    values = {} if explanation is None else explanation.values
    free = 0 if explanation is None else explanation.free
    return data.problem(data.stacked_mm - data.chain.stacked(values), free, explained=explanation is not None)


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """A completed search: measurement and model, findings, and the results of reference slots."""

    data: Observations
    found: Findings
    said: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Settings of searches."""

    rng: np.random.Generator
    forced: frozenset[str]
    progress: Progress

    def again(self, data: Observations, known: Explanation | None = None) -> Searched:
        """Search again, with the noise estimated from the residual of a known explanation."""
        found = search(partial(problem_of, data), self.rng, self.forced, self.progress, known)
        found, said = consistent_with_gauges(data, found)
        return Searched(data, found, said)

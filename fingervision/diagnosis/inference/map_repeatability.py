"""Check that a map of position errors is repeatable: a map fitted to some passes must predict the remaining passes.

By definition, a map of position errors is the same at each visit of a position (ISO 230-2). A curve over the input can
also be fitted to runs that differ in gain, or to a creep interrupted by stops, but such a curve does not predict a run
that was not used in its fit.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.position_map import NODES, PositionMap
from fingervision.diagnosis.inference.random_effect import LEAST_GAIN
from fingervision.domain.effect import Array, History

MOST_PASSES = 8
"""Largest number of parts into which the passes of one run are divided: more parts contain less information each and
cost as much."""


def foretells_other_passes(problem: Problem, explanation: Explanation, position_map: PositionMap) -> bool:
    """Cross-validate a map: predict each part (run, or visit of the positions in a single run) from all other parts.

    The log predictive density of a part of the data is the log density of all rows minus that of all rows outside the
    part (Geisser & Eddy 1979, doi:10.1080/01621459.1979.10481632). The sum of the log predictive densities over the
    parts must be larger with the map than without it, and no part may contradict the other parts by very strong
    evidence: the error of a single run is not a map.

    Parameters
    ----------
    problem : Problem
        Estimation problem without the map.
    explanation : Explanation
        Effects with which the map was estimated.
    position_map : PositionMap
        The map; its coefficients are standard normal numbers.

    Returns
    -------
    bool
        Whether the map predicts the parts left out; True also if no part can be left out.
    """
    part = _parts(problem.chain.history)
    numbers = np.unique(part)
    if numbers.size < 2:
        return True
    offsets, metric = problem.offsets, problem.offsets.metric(explanation.sigma_mm)

    def beside_offsets(columns: Array) -> Array:
        return np.asarray(columns - offsets.design @ (metric @ (offsets.design.T @ columns)))

    columns = beside_offsets(problem.whitener.columns(position_map.columns_mm)[0])
    residual = beside_offsets(explanation.residual)
    rows = np.tile(part, residual.size // part.size)
    each = [
        (columns[rows == number].T @ columns[rows == number], columns[rows == number].T @ residual[rows == number])
        for number in numbers
    ]
    gram, aim = sum(matrix for matrix, _ in each), sum(right for _, right in each)
    whole = _gain(gram, aim)
    foretold = [whole - _gain(gram - matrix, aim - right) for matrix, right in each]
    return sum(foretold) > 0.0 and min(foretold) > -LEAST_GAIN


def _gain(gram: Array, aim: Array) -> float:
    """Difference of twice the log marginal likelihood with and without a map."""
    inner = np.eye(aim.size) + gram
    return float(aim @ np.linalg.solve(inner, aim) - np.linalg.slogdet(inner)[1])


def _parts(history: History) -> NDArray[np.intp]:
    """Part to which each row belongs: its run or, in a single run, the number of earlier visits of its position."""
    input_mm = history.input_mm
    part = np.zeros(input_mm.size, dtype=np.intp)
    if len(history.runs) > 1:
        for number, run in enumerate(history.runs):
            part[run] = number
        return part
    place = np.floor((input_mm - input_mm.min()) / max(history.input_span_mm, 1e-300) * (NODES - 1) + 0.5).astype(int)
    visits, before = dict[int, int](), -1
    for row, here in enumerate(place.tolist()):
        if here != before:
            visits[here] = visits.get(here, -1) + 1
        part[row] = visits[here] % MOST_PASSES
        before = here
    return part

"""Whether a map of position errors can be told from effects, and whether it predicts readings it was not fitted to.

A map can represent functions of position alone, except a straight line.

If a map is fitted too, no data can distinguish an effect that is a function of position from the map, however large the
effect is. Effects with reversal, memory or dependence on time can be distinguished from a map.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.position_map import NAME, NODES, PositionMap, map_columns
from fingervision.diagnosis.inference.random_effect import LEAST_GAIN, evidence_of
from fingervision.diagnosis.inference.signatures import signatures
from fingervision.diagnosis.noise.run_offsets import WhitenedColumns
from fingervision.domain.effect import Flags, History

LINE_SHARE = 1e-3
"""Share of the squared length that a straight-line fit may leave of an effect that counts as a line: over a stroke,
ratios and offsets deviate from a line by less. A map contains no straight line."""
CURVE_SHARE = 0.02
"""Share of the squared length, beyond the line, that a curve over position may leave of an effect that counts as a map:
14 % in amplitude, less than the inexactness of effects' formulas for real stages (ISO 230-2 reversals: 19 to 24 %)."""


def imitating_effects(problem: Problem, position_map: PositionMap) -> dict[str, str]:
    """Find effects that act like a map for all values of their parameters.

    Parameters
    ----------
    problem : Problem
        Estimation problem without the map.
    position_map : PositionMap
        The map.

    Returns
    -------
    reasons : dict of str to str
        Reason, by name of effect, why the data cannot show it.
    """
    still = _of_the_place(problem)
    atoms = signatures(replace(problem, effects={name: problem.effects[name] for name in still})) if still else None
    if atoms is None:
        return {}
    owner = np.array(atoms.names)
    lines, mapped = _held(problem, position_map, atoms.columns)
    return {
        name: _reason(problem)
        for name in still
        if np.any(mapped[owner == name]) and np.all((mapped | lines)[owner == name])
    }


def _of_the_place(problem: Problem) -> list[str]:
    return [
        name
        for name, effect in problem.effects.items()
        if not (effect.memory or effect.needs_times or name == NAME or name in problem.stalled)
    ]


def _reason(problem: Problem) -> str:
    history = problem.chain.history
    span = f"{history.input_mm.min():g} to {history.input_mm.max():g} mm"
    return f"it cannot be distinguished from the map of position errors: over {span} it depends on the position alone"


def _held(problem: Problem, position_map: PositionMap, columns: WhitenedColumns) -> tuple[Flags, Flags]:
    """Whether a straight line represents each whitened column, and whether a map's curve represents the remainder."""
    nodes_mm = position_map.nodes_mm
    raw = map_columns(problem.chain, nodes_mm)
    line = np.stack([np.ones_like(nodes_mm), nodes_mm - nodes_mm.mean()], axis=1)
    curve, straight = problem.whitener.columns(raw)[0], problem.whitener.columns(raw @ line)[0]
    nothing = problem.nothing()
    metric = problem.offsets.metric(nothing.sigma_mm)
    bent, left = (columns.against(nothing.residual, metric, beside)[1] for beside in (straight, curve))
    lines = bent < LINE_SHARE * columns.squares
    return lines, ~lines & (left < CURVE_SHARE * bent)


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

    columns = offsets.beside(problem.whitener.columns(position_map.columns_mm)[0], metric)
    residual = offsets.beside(explanation.residual, metric)
    rows = np.tile(part, residual.size // part.size)
    each = [
        (columns[rows == number].T @ columns[rows == number], columns[rows == number].T @ residual[rows == number])
        for number in numbers
    ]
    gram, aim = sum(matrix for matrix, _ in each), sum(right for _, right in each)
    whole = evidence_of(gram, aim)
    foretold = [whole - evidence_of(gram - matrix, aim - right) for matrix, right in each]
    return sum(foretold) > 0.0 and min(foretold) > -LEAST_GAIN


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

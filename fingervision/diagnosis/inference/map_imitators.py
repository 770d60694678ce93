"""Effects that a map of position errors can represent: functions of position alone, except a straight line.

If a map is fitted too, no data can distinguish an effect that is a function of position from the map, however large the
effect is. Effects with reversal, memory or dependence on time can be distinguished from a map.
"""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.position_map import NAME, PositionMap, map_columns
from fingervision.diagnosis.inference.signatures import signatures
from fingervision.domain.effect import Array, Flags

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


def imitating_parts(problem: Problem, position_map: PositionMap, explanation: Explanation) -> dict[str, str]:
    """Find effects of an explanation that act like a map at their fitted parameters.

    For example, a cyclic error with a period of half the range acts like a map, because a map can follow so smooth a
    curve.

    Parameters
    ----------
    problem : Problem
        Estimation problem without the map.
    position_map : PositionMap
        The map.
    explanation : Explanation
        Effects found in addition to the map.

    Returns
    -------
    reasons : dict of str to str
        Reason, by name of effect, why it is excluded if a map is fitted.
    """
    chain, values = problem.chain, explanation.values
    whole = chain.stacked(values)
    named = [name for name in _of_the_place(problem) if name in values]
    if not named:
        return {}
    alone = [whole - chain.stacked({key: value for key, value in values.items() if key != name}) for name in named]
    _, mapped = _held(problem, position_map, problem.whitener.columns(np.stack(alone, axis=1))[0])
    return {name: _reason(problem) for name, held in zip(named, mapped.tolist(), strict=True) if held}


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


def _held(problem: Problem, position_map: PositionMap, columns: Array) -> tuple[Flags, Flags]:
    """Whether a straight line represents each whitened column, and whether a map's curve represents the remainder."""
    nodes_mm = position_map.nodes_mm
    raw = map_columns(problem.chain, nodes_mm)
    line = np.stack([np.ones_like(nodes_mm), nodes_mm - nodes_mm.mean()], axis=1)
    curve, straight = problem.whitener.columns(raw)[0], problem.whitener.columns(raw @ line)[0]
    offsets, metric = problem.offsets, problem.offsets.metric(problem.nothing().sigma_mm)

    def left(beside: Array) -> Array:
        """Squared lengths of the parts of columns orthogonal to run offsets and to the columns `beside`; shape (k,)."""
        moved = beside - offsets.design @ (metric @ (offsets.design.T @ beside))
        rest = columns - beside @ (np.linalg.pinv(beside.T @ moved) @ (moved.T @ columns))
        shared = offsets.design.T @ rest
        return np.asarray(np.einsum("ij,ij->j", rest, rest) - np.einsum("ij,ij->j", shared, metric @ shared))

    bent = left(straight)
    lines = bent < LINE_SHARE * np.einsum("ij,ij->j", columns, columns)
    return lines, ~lines & (left(curve) < CURVE_SHARE * bent)

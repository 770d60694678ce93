"""Reference slots measured during a run: a camera error affects slot and gap, a gripper error only the gap.

The gap alone cannot distinguish a wrong scale from a wrong lever ratio, nor an edge bias from a wrong rest gap; a
measured slot of known width can distinguish them.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import PointEffect
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.measured_table import ReferenceSlot
from fingervision.domain.response import Response
from fingervision.effects import catalogue, that_show

REFUTED = 9.0
"""Difference in chi-square per slot above which an explanation is refuted by another that predicts the slot better:
three standard uncertainties."""
STEP = 0.1
"""Step of a parameter, in standard uncertainties, for propagating its uncertainty to the width of a slot."""

Values = Mapping[str, Mapping[str, float]]


def consistent_with_gauges(data: Observations, found: Findings) -> tuple[Findings, tuple[str, ...]]:
    """Drop the explanations that a reference slot contradicts, and report the result of the slots.

    If the slots contradict all explanations, none is dropped, and a sentence reports that something else is wrong.

    Returns
    -------
    Findings
        Findings with the best of the remaining explanations first.
    tuple of str
        One sentence for each slot, and one about dropped explanations.
    """
    slots = data.table.slots
    if not slots:
        return found, ()
    members = found.alternatives or (found.best,)
    costs = [sum(_surprise(data, e, slot) for slot in slots) for e in members]
    said = tuple(_sentence(data, members[int(np.argmin(costs))], slot) for slot in slots)
    least = min(costs)
    if found.unknown is not None or len(members) < 2 or least >= REFUTED * len(slots):
        return found, said
    left = [e for e, cost in zip(members, costs, strict=True) if cost - least < REFUTED]
    if len(left) == len(members):
        return found, said
    dropped = " and ".join("+".join(e.names) for e in members if e not in left)
    best = min(left, key=lambda e: e.score + costs[members.index(e)])
    others = [e for e in left if e is not best]
    told = replace(found, best=best, alternatives=(best, *others))
    return told, (*said, f"the measured width of the reference slot rules out {dropped}.")


def seen_mm(data: Observations, values: Values, size_mm: float) -> float:
    """Width that would be measured for a slot if an explanation is true (mm)."""
    half = np.full(1, 0.5 * size_mm)
    response, acting = Response(-half, half), {**data.chain.fixed, **values}
    for name in that_show(FurtherCheck.SLOT):
        effect = catalogue()[name]
        if name in acting and isinstance(effect, PointEffect):
            response = effect.act(response, data.chain.history, acting[name])
    return float(response.gap_mm[0])


def _surprise(data: Observations, explanation: Explanation, slot: ReferenceSlot) -> float:
    """Chi-square of a slot under an explanation."""
    off_mm = slot.measured_mm - seen_mm(data, explanation.values, slot.size_mm)
    return float((off_mm / _u_mm(data, explanation, slot)) ** 2)


def _u_mm(data: Observations, explanation: Explanation, slot: ReferenceSlot) -> float:
    """Standard uncertainty of measured minus predicted slot width (mm): from slot, picture and parameters."""
    values = {name: dict(given) for name, given in explanation.values.items()}
    listed = [(name, key) for name in explanation.names for key in values[name]]
    slopes = np.zeros(len(listed))
    spread = np.sqrt(np.maximum(np.diag(explanation.covariance), 0.0))
    at_mm, shown = seen_mm(data, values, slot.size_mm), that_show(FurtherCheck.SLOT)
    for k, (name, key) in enumerate(listed):
        if name in shown and spread[k] > 0.0:
            moved = {**values, name: {**values[name], key: values[name][key] + STEP * spread[k]}}
            slopes[k] = (seen_mm(data, moved, slot.size_mm) - at_mm) / (STEP * spread[k])
    by_parameters = float(slopes @ explanation.covariance @ slopes)
    return float(np.sqrt(slot.u_size_mm**2 + slot.u_random_mm**2 + by_parameters))


def _sentence(data: Observations, explanation: Explanation, slot: ReferenceSlot) -> str:
    expected_mm = seen_mm(data, explanation.values, slot.size_mm)
    fits = "as" if _surprise(data, explanation, slot) < REFUTED else "but"
    answer = "+".join(explanation.names) or "the model"
    return (
        f"the reference slot of {slot.size_mm:g} mm measures {slot.measured_mm:.4f} mm, {fits} {answer} predicts "
        f"{expected_mm:.4f} mm."
    )

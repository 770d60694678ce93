"""Next measurements without another motion: re-zeroing the stage, or a slot of known width in front of the camera."""

import numpy as np

from fingervision.diagnosis.design.protocols import REZERO, Step, measured_ends, protocols
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import PointEffect
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.report import NextRun
from fingervision.domain.response import Response
from fingervision.effects import that_show

WORTH = 9.0
"""Gain in chi-square above which two explanations count as separated."""
UNTIMED_S = 0.1
"""Assumed time between samples of a run, if the table has no times."""
SLOT_FRAMES, SLOT_U_MM = 10, 0.002
"""Number of frames averaged on a reference slot, and standard uncertainty of the slot's width: that of an ordinary
gauge block."""


def static_check(data: Observations, problem: Problem, best: Explanation, rivals: list[Explanation]) -> NextRun | None:
    """Propose a check without another motion that separates the best explanation from another explanation.

    For a table without times, no motion can be evaluated for effects with memory, and re-zeroing is proposed as a check
    of its own. For a table with times, re-zeroing is one of the protocols.
    """
    for rival in rivals:
        pair = (best, rival)
        if data.chain.history.time_s is None and _one_shows(FurtherCheck.REZERO, pair):
            return _rezeroed(data, problem, pair)
        if _one_shows(FurtherCheck.SLOT, pair):
            return _slot(data, problem, pair)
    return None


def _one_shows(check: FurtherCheck, pair: tuple[Explanation, Explanation]) -> bool:
    return sum(not set(e.names).isdisjoint(that_show(check)) for e in pair) == 1


def _rezeroed(data: Observations, problem: Problem, pair: tuple[Explanation, Explanation]) -> NextRun | None:
    """Propose re-zeroing the stage, after which an offset of the input disappears and an offset of the gap remains."""
    zeroed = that_show(FurtherCheck.REZERO)
    offset = next(e for e in pair if not set(e.names).isdisjoint(zeroed))
    history, offsets = data.chain.history, problem.offsets
    ends = measured_ends(data.table.input_mm, data.model.input_range_mm)
    steps = [REZERO, *protocols(*ends, UNTIMED_S)[0][1]]
    moved = data.chain.stacked(
        {name: offset.values[name] for name in offset.names if name in zeroed}
    ) - data.chain.stacked({})
    size = float(np.mean(moved[: history.input_mm.size]))
    known = np.diag(offsets.gram)[: offsets.runs]
    spread = float(
        np.sqrt(1.0 / np.sum(known) + 1.0 / np.mean(known) + offset.sigma_mm[0] ** 2 * (1.0 + 1.0 / offsets.runs))
    )
    return _still("re-zero the stage and repeat", steps, size, spread, pair)


def _slot(data: Observations, problem: Problem, pair: tuple[Explanation, Explanation]) -> NextRun | None:
    """Propose a slot of known width: a camera error changes gap and slot width, a gripper error only the gap."""
    slot = np.full(1, round(data.chain.history.rest_gap_mm, 1))
    response = Response(-0.5 * slot, 0.5 * slot)
    for name in that_show(FurtherCheck.SLOT):
        acting = next((e.values[name] for e in pair if name in e.names), None)
        effect = problem.effects.get(name)
        if acting is not None and isinstance(effect, PointEffect):
            response = effect.act(response, data.chain.history, acting)
    size = float(response.gap_mm[0] - slot[0])
    spread = float(np.hypot(problem.whitener.noises[0].total_mm / np.sqrt(SLOT_FRAMES), SLOT_U_MM))
    steps: list[Step] = [{"kind": "reference_slot", "size_mm": float(slot[0]), "u_size_mm": SLOT_U_MM}]
    return _still("measure a reference slot", steps, size, spread, pair)


def _still(
    name: str, steps: list[Step], size: float, spread: float, pair: tuple[Explanation, Explanation]
) -> NextRun | None:
    """Propose a check whose result differs by `size` between the two explanations and has the uncertainty `spread`."""
    gain = (size / spread) ** 2
    if gain <= WORTH:
        return None
    half = 1.96 * 2.0 * float(np.sqrt(gain))
    names = ("+".join(pair[0].names), "+".join(pair[1].names))
    words = f"{name}: it separates {' from '.join(names)} by an expected chi-square of {gain:.0f}."
    return NextRun(name, tuple(steps), gain, (max(0.0, gain - half), gain + half), names, words)

"""What to do next with a result: the proposed run, or what the table lacks and where most remains unexplained."""

from itertools import pairwise

import numpy as np

from fingervision.diagnosis.design.protocols import REZERO, Step, measured_ends, protocols
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.position_map import PASSES
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import History, PointEffect
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.report import NextRun, Place, Verdict
from fingervision.domain.response import Response
from fingervision.effects import catalogue, that_show

CHECK = (
    "A single explanation remains: compare the corrected model with a run that was not used here (fingervision compare "
    "NEW --model model.toml)."
)
"""Next step after a named explanation."""
MOVING = 0.05
"""Speed, as a share of the largest, above which the stage counts as moving."""
SECOND_SPEED = 2.0
"""Least ratio of two speeds that tells a lag from a play."""
HOLD_SHARE = 0.05
"""Least share of the longest run that a hold must last to show what goes on while the input is held."""
MOST_ADVICE = 2
"""Pieces of advice in one sentence, the most important ones: a reader does one thing at a time."""


def next_look(
    data: Observations, decided: Verdict, proposal: NextRun | None, left: tuple[Place, ...], *, mistaken: bool
) -> str:
    """Say what to do next; there is always something.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    decided : Verdict
        Result of the diagnosis.
    proposal : NextRun or None
        Proposed run, if explanations remain that a run separates.
    left : tuple of Place
        Regions in which the residual after the named effects is more than noise.
    mistaken : bool
        Whether a mistake in the table explains more than any effect.
    """
    if proposal is not None:
        return proposal.words
    if mistaken:
        return "Check the question about the table, correct what is mistaken, and diagnose again."
    if decided is Verdict.NAMED:
        return CHECK
    if decided is Verdict.AGREES:
        return "None is needed; more repeats of the same run would show smaller effects than those listed."
    if decided is Verdict.AMBIGUOUS:
        return (
            "No run that the test bed can execute separates the remaining explanations; the notes list other "
            "measurements that would, if there are any."
        )
    where = f"Look first where most remains: {left[0].words}. " if left else ""
    return f"{where}Then {' and '.join(lacking(data)[:MOST_ADVICE])}."


def lacking(data: Observations) -> list[str]:
    """Advise what to measure that the table does not contain, the most important first; never empty."""
    history = data.chain.history
    if history.time_s is None:
        return ["record the run again with time_s, without which nothing that depends on the order of rows has a name"]
    speeds = np.concatenate([np.abs(np.diff(history.input_mm[run]) / _apart_s(history, run)) for run in history.runs])
    moving = speeds[speeds > MOVING * np.max(speeds, initial=0.0)]
    slow, fast = np.quantile(moving, [0.1, 0.9]) if moving.size else (1.0, 1.0)
    advice = []
    if not _goes_both_ways(history):
        advice.append(
            "drive the range in the other direction too, which tells play and friction from errors of position"
        )
    elif history.travel_mm < PASSES * history.input_span_mm:
        advice.append("come back to each position, which tells an error of position from a change over time")
    if data.repeats is None and history.dwell_s > 0.0:
        advice.append("read each position at least three times from the same side, which shows the noise itself")
    if history.dwell_s == 0.0 and fast < SECOND_SPEED * slow:
        advice.append("drive the same strokes at a third of the speed, which tells what depends on time from the rest")
    if history.dwell_s == 0.0 and _longest_hold_s(history) < HOLD_SHARE * _longest_run_s(history):
        advice.append("hold the input at both ends for half a minute, which shows creep, drift and ringing")
    if not history.both_edges:
        advice.append("measure both fingers (left_mm and right_mm), which tells the camera from the mechanism")
    return [*advice, "repeat the same run: what returns belongs to the set-up, what does not is no property of it"]


def _apart_s(history: History, run: slice) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.maximum(np.diff(history.times[run]), 1e-9)


def _goes_both_ways(history: History) -> bool:
    """Whether each direction has at least a tenth of the travel."""
    steps = np.concatenate([np.diff(history.input_mm[run]) for run in history.runs])
    up, down = float(steps[steps > 0.0].sum()), float(-steps[steps < 0.0].sum())
    return min(up, down) > 0.1 * (up + down)


def _longest_run_s(history: History) -> float:
    return max(float(np.ptp(history.times[run])) for run in history.runs)


def _longest_hold_s(history: History) -> float:
    """Longest time for which the recorded input changes by no more than its error."""
    longest = 0.0
    for run in history.runs:
        still = np.abs(np.diff(history.input_mm[run])) <= max(
            2.0 * history.input_sigma_mm, 1e-6 * history.input_span_mm
        )
        borders = [-1, *np.flatnonzero(~still).tolist(), still.size]
        time_s = history.times[run]
        longest = max([longest, *(float(time_s[end] - time_s[begin + 1]) for begin, end in pairwise(borders))])
    return longest


def further_evidence(alternatives: tuple[Explanation, ...]) -> tuple[str, ...]:
    """Advise how to distinguish explanations that differ by one effect each; one sentence per pair of effects.

    Parameters
    ----------
    alternatives : tuple of Explanation
        Explanations that the data cannot distinguish.
    """
    found: dict[tuple[frozenset[str], FurtherCheck], None] = {}
    for one in alternatives:
        for other in alternatives:
            differing = frozenset(one.names) ^ frozenset(other.names)
            if len(differing) == 2 and len(one.names) == len(other.names):
                found.update({(differing, check): None for check in checks_between(*differing)})
    return tuple(f"{' or '.join(sorted(pair))}: {check.value}." for pair, check in found)


def checks_between(one: str, other: str) -> tuple[FurtherCheck, ...]:
    """Checks in which one effect is visible and the other is not."""
    first, second = (catalogue()[name].checks for name in (one, other))
    return tuple(check for check in FurtherCheck if {first.get(check), second.get(check)} == {True, False})


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

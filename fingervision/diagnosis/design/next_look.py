"""What to do next with a result: the proposed run, or what the table lacks and where most remains unexplained."""

from itertools import pairwise

import numpy as np

from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import History
from fingervision.domain.report import NextRun, Place, Verdict

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
TWICE = 1.8
"""Least ratio of travel to range with which each position was passed twice."""
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
    elif _travel_mm(history) < TWICE * history.input_span_mm:
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


def _travel_mm(history: History) -> float:
    return sum(float(np.sum(np.abs(np.diff(history.input_mm[run])))) for run in history.runs)


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

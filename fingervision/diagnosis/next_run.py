"""The next run: the protocol that separates what is open, by expected distance per minute (Atkinson & Fedorov 1975)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.bench_data import BenchData
from fingervision.diagnosis.bootstrap import noise_doubt
from fingervision.diagnosis.drawing_refit import tangent
from fingervision.diagnosis.explanation import Explanation, Point, Problem, fit
from fingervision.diagnosis.posterior import draws
from fingervision.diagnosis.protocols import Step, driven, protocols, rounding_s
from fingervision.diagnosis.still_proposals import WORTH, without_motion
from fingervision.diagnosis.whitening import RunOffsets, Whitener
from fingervision.domain.effect import Array, History
from fingervision.domain.model import PhysicalModel
from fingervision.domain.report import NextRun

SETTLE_MIN = 0.5
"""Minutes that any run costs beside its motion: starting, saving."""
STILL_MIN = 1.5
"""Minutes that re-zeroing, or putting a slot before the camera, takes."""
MOST_SAMPLES = 6000
ENOUGH = 50.0
"""Separating a pair more surely than this is worth no further minute."""
MOST_RIVALS = 6
TRUTHS = 16
"""Draws of either explanation's parameters behind a promise."""
FURTHER = 3
"""Further starts of a rival's refit: one search may stand still beside the place where it imitates the truth."""
SMALLER = (0.7, 0.5, 0.35, 0.25, 0.15)
"""Shares of the range that are tried one after the other."""
AT_END = 0.01
"""Share of its range within which a parameter lies at the end."""
PROMISED = 0.95
Settings = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True, eq=False)
class _Proposal:
    """A run with what it is worth: the chi-square by which it parts the leading explanation from each rival."""

    name: str
    steps: list[Step]
    inputs_mm: Array
    gains: tuple[float, ...]
    minutes: float

    @property
    def worth(self) -> float:
        """Expected separation a minute."""
        return sum(min(gain, ENOUGH) for gain in self.gains if gain > WORTH) / self.minutes


def _joined(bench: BenchData, problem: Problem, inputs: Array) -> Problem:
    """Put a run behind the data: same noise, later on the same clock."""
    old = bench.chain.history
    step_s = old.sample_time_s
    time = float(old.times.max()) + 60.0 * SETTLE_MIN + step_s * np.arange(inputs.size)
    history: History = replace(
        old,
        input_mm=np.concatenate([old.input_mm, inputs]),
        time_s=np.concatenate([old.times, time]),
        runs=(*old.runs, slice(old.input_mm.size, old.input_mm.size + inputs.size)),
    )
    n = old.input_mm.size
    aside = np.concatenate(
        [
            part
            for channel in range(len(bench.channels))
            for part in (problem.whitener.aside[channel * n : (channel + 1) * n], np.zeros(inputs.size, dtype=bool))
        ]
    )
    extra = float(np.median(problem.whitener.input_mm))
    chain, drawn = replace(problem.chain, history=history), bench.model.base
    whitener = Whitener(
        history,
        problem.whitener.noises,
        aside,
        np.concatenate([problem.whitener.input_mm, np.full(inputs.size, extra)]),
        problem.whitener.input_samples,
        np.concatenate(
            [problem.whitener.passing_mm, np.full(inputs.size, float(np.median(problem.whitener.passing_mm)))]
        ),
        tangent(chain, drawn, bench.refit.moved).columns
        if bench.refit.moved and isinstance(drawn, PhysicalModel)
        else None,
    )
    empty = np.zeros(history.input_mm.size * len(bench.channels))
    return replace(problem, chain=chain, whitener=whitener, measured=empty, offsets=RunOffsets.of(whitener))


def _moved_bounds(old: Problem, new: Problem, names: tuple[str, ...], values: Settings) -> Point:
    """Values for a table of another range: a stop that was not seen lies at the range's end, wherever that is."""
    out: Point = {name: dict(values[name]) for name in names}
    for (name, was), (_, now) in zip(old.parameters(names), new.parameters(names), strict=True):
        near = AT_END * (was.upper - was.lower)
        value = values[name][was.name]
        if was.lower != now.lower and value <= was.lower + near:
            out[name][was.name] = now.lower
        elif was.upper != now.upper and value >= was.upper - near:
            out[name][was.name] = now.upper
    return out


def _apart(problem: Problem, values: Settings, rival: Explanation, starts: Sequence[Settings]) -> float:
    """Distance of a prediction to a rival, over the rival's parameters; the nearest of several searches."""
    target = problem.whitened(values)
    return min(
        fit(problem, rival.names, start, target=target, sigma_mm=rival.sigma_mm, iterations=8).score for start in starts
    )


def _gain(
    old: Problem, joined: Problem, truth: Settings, rival: Explanation, starts: Sequence[Settings], before: float
) -> float:
    """What a run adds to the distance `before` it: the rival is refitted to old and new data together."""
    anew = [_moved_bounds(old, joined, rival.names, start) for start in starts]
    return max(0.0, _apart(joined, _moved_bounds(old, joined, tuple(truth), truth), rival, anew) - before)


def _promise(
    old: Problem,
    joined: Problem,
    pair: tuple[Explanation, Explanation],
    found: tuple[Point, ...],
    rng: np.random.Generator,
) -> tuple[float, tuple[float, float]]:
    """Gain to expect whichever of the two is true, and the interval that holds what will come.

    The truth's parameters are drawn from what the data leave open, and the noise is known only so well; the new run's
    own noise adds 2 sqrt(gain) to the difference of two chi-squares.
    """
    gains: list[float] = []
    count = TRUTHS if joined.chain.history.input_mm.size <= MOST_SAMPLES else TRUTHS // 4
    drawn = (found, draws(old, pair[1], rng))
    for truth, rival in ((0, 1), (1, 0)):
        starts = [pair[rival].values, *drawn[rival][:: max(1, len(drawn[rival]) // FURTHER)]]
        step = max(1, len(drawn[truth]) // count)
        for values in drawn[truth][step // 2 :: step]:
            before = _apart(old, values, pair[rival], starts)
            gains.append(_gain(old, joined, values, pair[rival], starts, before))
    expected = np.array(gains)
    doubt = np.exp(noise_doubt(old) * rng.standard_normal((expected.size, 400)))
    come = expected[:, None] * doubt
    come = come + 2.0 * np.sqrt(come) * rng.standard_normal(come.shape)
    low, high = np.quantile(come, (0.5 - 0.5 * PROMISED, 0.5 + 0.5 * PROMISED))
    return float(np.median(expected)), (float(low), float(high))


def _proposals(
    bench: BenchData,
    problem: Problem,
    best: Explanation,
    rivals: list[Explanation],
    ends: tuple[float, float],
    only: str | None = None,
) -> list[_Proposal]:
    """Try every protocol between two ends of the input; of the two that might be true, the one that shows less."""
    history = bench.chain.history
    step_s = history.sample_time_s
    round_s = rounding_s(bench.table.input_mm, step_s, history.runs)
    pairs = [(best, rival) for rival in rivals]
    known = [[_apart(problem, one.values, other, [other.values]) for one, other in (p, p[::-1])] for p in pairs]
    found = []
    for name, steps in protocols(*ends, step_s):
        inputs = driven(steps, step_s, round_s)
        if inputs.size > MOST_SAMPLES or (only is not None and name != only):
            continue
        joined = _joined(bench, problem, inputs)
        gains = []
        for (one, other), (ahead, back) in zip(pairs, known, strict=True):
            gain = _gain(problem, joined, one.values, other, [other.values], ahead)
            if gain > WORTH:
                gain = min(gain, _gain(problem, joined, other.values, one, [one.values], back))
            gains.append(gain)
        found.append(_Proposal(name, steps, inputs, tuple(gains), SETTLE_MIN + inputs.size * step_s / 60.0))
    return found


def _no_larger_than_needed(
    bench: BenchData, problem: Problem, best: Explanation, rivals: list[Explanation], chosen: _Proposal
) -> _Proposal:
    """Drive the same over less of the range while it still separates every rival that it did, surely enough.

    Small motions are kinder to the gripper, and what a large one gains beyond need rests on the explanations' forms
    more than on what was measured.
    """
    low, high = float(chosen.inputs_mm.min()), float(chosen.inputs_mm.max())
    middle = 0.5 * (low + high)
    apart = [rival for rival, gain in zip(rivals, chosen.gains, strict=True) if gain > WORTH]
    for share in SMALLER:
        ends = middle + share * (low - middle), middle + share * (high - middle)
        (smaller,) = _proposals(bench, problem, best, apart, ends, chosen.name)
        if min(smaller.gains) < ENOUGH:
            break
        gains = iter(smaller.gains)
        chosen = replace(smaller, gains=tuple(next(gains) if gain > WORTH else gain for gain in chosen.gains))
    return chosen


def next_run(
    bench: BenchData,
    problem: Problem,
    members: list[Explanation],
    found: tuple[Point, ...],
    rng: np.random.Generator,
) -> NextRun | None:
    """Choose the run that separates what is open best, per minute of the rig's time.

    Runs within the range that was measured come first: beyond it an explanation's form is not proven, and neither is
    a promise that rests on it. The promise is for the pair of the leading explanation and the rival that the run
    separates least.

    Parameters
    ----------
    members : list of Explanation
        What this data cannot tell apart, the leading one first.
    found : tuple of dict
        Draws of the leading one's parameters.
    rng : numpy Generator
        For the promise's interval.

    Returns
    -------
    NextRun or None
        None where nothing is open, or nothing that can be driven would separate it.
    """
    if len(members) < 2:
        return None
    best, rivals = members[0], members[1 : 1 + MOST_RIVALS]
    u = bench.table.input_mm
    special = without_motion(bench, problem, best, rivals)
    proposals: list[_Proposal] = []
    if bench.chain.history.time_s is not None:
        proposals = _proposals(bench, problem, best, rivals, (float(u.min()), float(u.max())))
        if not any(gain > ENOUGH for proposal in proposals for gain in proposal.gains):
            proposals += _proposals(bench, problem, best, rivals, bench.model.input_range_mm)
    chosen = max(proposals, key=lambda proposal: proposal.worth, default=None)
    if special is not None and (chosen is None or min(special.gain, ENOUGH) / STILL_MIN > chosen.worth):
        return special
    if chosen is None or chosen.worth == 0.0:
        return special
    chosen = _no_larger_than_needed(bench, problem, best, rivals, chosen)
    apart = [(gain, rival) for gain, rival in zip(chosen.gains, rivals, strict=True) if gain > WORTH]
    rival = min(apart, key=lambda item: item[0])[1]
    joined = _joined(bench, problem, chosen.inputs_mm)
    gain, interval = _promise(problem, joined, (best, rival), found, rng)
    also = ["+".join(other.names) for _, other in apart if other is not rival]
    left = ["+".join(other.names) for other in members[1:] if all(other is not one for _, one in apart)]
    pair = ("+".join(best.names), "+".join(rival.names))
    words = f"{chosen.name}: it separates {' from '.join(pair)} by an expected chi-square of {gain:.0f}"
    words += f", and further {', '.join(also)}" if also else ""
    words += f"; no protocol tried separates {', '.join(left)}." if left else "."
    return NextRun(chosen.name, tuple(chosen.steps), gain, interval, pair, words)

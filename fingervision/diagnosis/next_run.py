"""The next run: the protocol that separates what is open, by expected distance per minute (Atkinson & Fedorov 1975)."""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.bench_data import BenchData
from fingervision.diagnosis.explanation import Explanation, Problem, fit
from fingervision.diagnosis.whitening import RunOffsets, Whitener
from fingervision.domain.effect import Array, History
from fingervision.domain.report import NextRun

Step = dict[str, object]
SETTLE_MIN = 0.5
"""Minutes that any run costs beside its motion: starting, saving."""
MOST_SAMPLES = 1500
WORTH = 9.0
"""Gain in chi-square above which two explanations count as separated."""
ENOUGH = 50.0
"""Separating a pair more surely than this is worth no further minute."""


def _motion(step: Step, start: float, step_s: float) -> Array:
    """Where the stage is at each sample of a step, shape (k,)."""

    def number(key: str) -> float:
        return float(str(step[key]))

    def ramp(a: float, b: float, speed: float) -> Array:
        return np.linspace(a, b, max(2, round(abs(b - a) / speed / step_s) + 1))[1:]

    kind = step["kind"]
    if kind == "triangle":
        low, high, speed = number("from_mm"), number("to_mm"), number("speed_mm_s")
        cycle = [ramp(low, high, speed), ramp(high, low, speed)] * int(number("cycles"))
        return np.concatenate([ramp(start, low, speed), *cycle]) if abs(start - low) > 1e-9 else np.concatenate(cycle)
    if kind == "staircase":
        levels = np.linspace(number("from_mm"), number("to_mm"), int(number("steps")) + 1)
        parts, at = [], start
        for level in [*levels, *levels[-2::-1]]:
            if abs(level - at) > 1e-9:
                parts.append(ramp(at, float(level), number("speed_mm_s")))
            parts.append(np.full(max(1, round(number("dwell_s") / step_s)), level))
            at = float(level)
        return np.concatenate(parts)
    if kind == "move":
        return ramp(start, number("to_mm"), number("speed_mm_s"))
    return np.full(max(1, round(number("seconds") / step_s)), start)


def protocols(low_mm: float, high_mm: float) -> list[tuple[str, list[Step]]]:
    """List what the test bed can run within the inputs that the model covers."""
    span = high_mm - low_mm
    low, high = round(low_mm + 0.03 * span, 4), round(high_mm - 0.03 * span, 4)
    middle = round(0.5 * (low + high), 4)

    def triangle(a: float, b: float, seconds: float, cycles: int = 1) -> Step:
        speed = round(abs(b - a) / seconds, 5)
        return {
            "kind": "triangle",
            "from_mm": a,
            "to_mm": b,
            "speed_mm_s": speed,
            "cycles": cycles,
            "frames": "continuous",
        }

    def stairs(steps: int, dwell_s: float) -> Step:
        return {
            "kind": "staircase",
            "from_mm": low,
            "to_mm": high,
            "steps": steps,
            "dwell_s": dwell_s,
            "speed_mm_s": round(span / 4.0, 5),
            "frames": "continuous",
        }

    return [
        ("repeat slowly", [triangle(low, high, 20.0)]),
        ("repeat fast", [triangle(low, high, 2.0, 3)]),
        ("two speeds", [triangle(low, high, 3.0, 2), triangle(low, high, 20.0)]),
        ("reversals", [triangle(low, middle, 5.0, 2), triangle(middle, high, 5.0, 2)]),
        ("decreasing loops", [triangle(low + k * span / 10.0, high - k * span / 10.0, 6.0) for k in range(4)]),
        ("staircase with holds", [stairs(8, 3.0)]),
        (
            "long hold",
            [
                {"kind": "move", "to_mm": high, "speed_mm_s": round(span / 2.0, 5)},
                {"kind": "hold", "at_mm": high, "seconds": 60.0},
            ],
        ),
        ("close fully", [triangle(low, round(low + 0.3 * span, 4), 8.0, 2)]),
        ("small loops", [triangle(round(middle - 0.05 * span, 4), round(middle + 0.05 * span, 4), 2.0, 5)]),
    ]


def _joined(bench: BenchData, problem: Problem, inputs: Array) -> Problem:
    """Put a run behind the data: same noise, later on the same clock."""
    old = bench.chain.history
    step_s = old.sample_time_s
    time = float(old.times.max()) + 5.0 + step_s * np.arange(inputs.size)
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
    whitener = Whitener(
        history,
        problem.whitener.noises,
        aside,
        np.concatenate([problem.whitener.input_mm, np.full(inputs.size, extra)]),
        problem.whitener.input_samples,
    )
    chain = replace(problem.chain, history=history)
    empty = np.zeros(history.input_mm.size * len(bench.channels))
    return replace(problem, chain=chain, whitener=whitener, measured=empty, offsets=RunOffsets.of(whitener))


def _reference(best: Explanation, others: list[Explanation], sigma_mm: float) -> tuple[str, list[Step], float] | None:
    """Propose what needs no motion: a re-zeroed stage has no input offset, a slot of known width no gripper."""
    names = [set(best.names), *(set(other.names) for other in others)]
    offset = next((e for e in (best, *others) if "input_offset" in e.names), None)
    if offset is not None and any("input_offset" not in group for group in names):
        shift = abs(offset.values["input_offset"]["offset_mm"])
        return "re-zero the stage and repeat", [{"kind": "rezero"}], shift
    camera = {"scale_error", "edge_bias", "lens_distortion", "camera_tilt"}
    if any(group & camera for group in names) and not all(group & camera for group in names):
        return "measure a reference slot", [{"kind": "reference_slot", "size_mm": 4.0, "u_size_mm": 0.002}], sigma_mm
    return None


def _between(problem: Problem, best: Explanation, other: Explanation) -> float:
    """Distance of the best explanation's prediction to another, over the other's parameters."""
    target = problem.whitened(best.values)
    return fit(problem, other.names, other.values, target=target, sigma_mm=best.sigma_mm, iterations=6).score


def next_run(bench: BenchData, problem: Problem, best: Explanation, others: list[Explanation]) -> NextRun | None:
    """Choose the run that separates the worst open pair best, per minute of the rig's time.

    Parameters
    ----------
    best, others : Explanation
        What this data cannot tell apart.

    Returns
    -------
    NextRun or None
        None where nothing is open.
    """
    if not others:
        return None
    names = tuple("+".join(e.names) for e in (best, *others))
    low, high = bench.model.input_range_mm
    sigma = problem.whitener.noises[0].total_mm
    slope = abs(float(np.ptp(bench.model.base.respond(np.array([low, high])).gap_mm))) / (high - low)
    special = _reference(best, others, sigma)
    found: list[tuple[float, float, str, list[Step], tuple[str, ...]]] = []
    if special is not None:
        name, steps, size = special
        run = protocols(max(low, float(bench.table.input_mm.min())), min(high, float(bench.table.input_mm.max())))[0][1]
        difference = slope * size if steps[0]["kind"] == "rezero" else 0.01
        spread = float(np.hypot(sigma / np.sqrt(10.0), max(best.sigma_mm[0], 1e-6)))
        gain = (difference / spread) ** 2
        steps = [*steps, *run] if steps[0]["kind"] == "rezero" else steps
        found.append((min(gain, ENOUGH) / 1.5, gain, name, steps, names))
    if bench.chain.history.time_s is not None:
        already = [_between(problem, best, other) for other in others[:6]]
        step_s = bench.chain.history.sample_time_s
        for name, steps in protocols(low, high):
            at, parts = float(str(steps[0].get("from_mm", low))), []
            for step in steps:
                parts.append(_motion(step, at, step_s))
                at = float(parts[-1][-1])
            inputs = np.concatenate(parts)
            minutes = SETTLE_MIN + inputs.size * step_s / 60.0
            if inputs.size > 4 * MOST_SAMPLES:
                continue
            joined = _joined(bench, problem, inputs)
            gains = [_between(joined, best, other) - known for other, known in zip(others[:6], already, strict=False)]
            apart = [(o, gain) for o, gain in zip(others, gains, strict=False) if gain > WORTH]
            if apart:
                separated = tuple("+".join(other.names) for other, _ in apart)
                worth = sum(min(gain, ENOUGH) for _, gain in apart) / minutes
                least = min(gain for _, gain in apart)
                found.append((worth, least, name, steps, ("+".join(best.names), *separated)))
    if not found:
        return None
    _, gain, name, steps, separates = max(found, key=lambda item: item[0])
    if gain < 4.0:
        return None
    half = 1.96 * (2.0 * float(np.sqrt(gain)) + 0.1 * gain)
    left = [n for n in names if n not in separates]
    words = f"{name}: it separates {' from '.join(separates)} by an expected chi-square of {gain:.0f}"
    words += f"; no protocol tried separates {', '.join(left)}." if left else "."
    return NextRun(name, tuple(steps), gain, (max(0.0, gain - half), gain + half), separates, words)

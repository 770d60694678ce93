"""Runs that a test bed can execute to distinguish explanations, as steps of a recipe and as input samples."""

import numpy as np

from fingervision.domain.effect import Array

Step = dict[str, object]
REZERO: Step = {"kind": "rezero"}
EDGE = 0.03
"""Share of the range left free at either end, because an offset or scale error must not drive the stage beyond it."""
ORDINARY_S, MOST_S = 0.3, 2.0
"""Duration of a reversal for an ordinary stage, and its largest value."""
FINE = 8
"""Steps per sample when a motion is composed."""
SAMPLES_A_STROKE = 15
"""Least number of samples in a stroke: shorter strokes differ mainly in their corners, which no stage executes
exactly."""


def _number(step: Step, key: str) -> float:
    return float(str(step[key]))


def _ramp(start: float, end: float, speed_mm_s: float, step_s: float) -> Array:
    return np.linspace(start, end, max(2, round(abs(end - start) / speed_mm_s / step_s) + 1))[1:]


def _driven(step: Step, start: float, step_s: float) -> Array:
    """Position of the stage at each sample of a step (mm), shape (k,)."""
    parts: list[Array] = []
    at = start

    def go(end: float) -> None:
        nonlocal at
        if abs(end - at) > 1e-9:
            parts.append(_ramp(at, end, _number(step, "speed_mm_s"), step_s))
        at = end

    match step["kind"]:
        case "triangle":
            go(_number(step, "from_mm"))
            for _ in range(int(_number(step, "cycles"))):
                go(_number(step, "to_mm"))
                go(_number(step, "from_mm"))
        case "staircase":
            levels = np.linspace(_number(step, "from_mm"), _number(step, "to_mm"), int(_number(step, "steps")) + 1)
            for level in levels:
                go(float(level))
                parts.append(np.full(max(1, round(_number(step, "dwell_s") / step_s)), level))
        case "move":
            go(_number(step, "to_mm"))
        case "hold":
            parts.append(np.full(max(1, round(_number(step, "seconds") / step_s)), start))
    return np.concatenate(parts)


def rounding_s(input_mm: Array, step_s: float, runs: tuple[slice, ...]) -> float:
    """Time that the stage takes to reverse its motion (s), from the sharpest reversal in a record.

    A reversal from speed v spread over T seconds has the acceleration 2 v / T. For a record without reversals, the
    value of an ordinary stage (a third of a second) is used.
    """
    speeds = np.concatenate([np.diff(input_mm[run]) for run in runs]) / step_s
    bends = np.concatenate([np.abs(np.diff(input_mm[run], 2)) for run in runs]) / step_s**2
    fast = float(np.quantile(np.abs(speeds), 0.95)) if speeds.size else 0.0
    if not bends.size or speeds.max() < 0.5 * fast or speeds.min() > -0.5 * fast:
        return ORDINARY_S
    return float(np.clip(2.0 * fast / max(float(bends.max()), 1e-12), 0.0, MOST_S))


def driven(steps: list[Step], step_s: float, round_s: float) -> Array:
    """Input samples of a recipe's moving steps, starting at rest where the first step starts.

    Parameters
    ----------
    steps : list of dict
        Triangles, staircases, moves and holds; a re-zeroing has no samples.
    step_s : float
        Time between samples.
    round_s : float
        Time over which the stage rounds its corners.

    Returns
    -------
    ndarray of float, shape (n,), in mm
    """
    moving = [step for step in steps if step["kind"] != "rezero"]
    at = _number(moving[0], "from_mm") if "from_mm" in moving[0] else 0.0
    parts = [np.array([at])]
    for step in moving:
        parts.append(_driven(step, at, step_s / FINE))
        at = float(parts[-1][-1])
    path = np.concatenate(parts)
    width = round(round_s / step_s * FINE) // 2
    padded = np.pad(path, width, mode="edge")
    return np.convolve(padded, np.full(2 * width + 1, 1.0 / (2 * width + 1)), "valid")[::FINE]


def measured_ends(input_mm: Array, within_mm: tuple[float, float]) -> tuple[float, float]:
    """The measured range of the input (mm), extended to the stage's zero if a run would start or reverse near it.

    A stage position only one or two encoder steps from zero would be poorly known.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Measured input.
    within_mm : tuple of float
        Range of inputs that the model covers.
    """
    low, high = float(input_mm.min()), float(input_mm.max())
    free = EDGE * (high - low)
    if abs(low) < free and low - 2.0 * free > within_mm[0]:
        low = -EDGE * high / (1.0 - EDGE)
    if abs(high) < free and high + 2.0 * free < within_mm[1]:
        high = -EDGE * low / (1.0 - EDGE)
    return low, high


def repeated(steps: list[Step], times: int) -> list[Step]:
    """Repeat a protocol within one run: triangles by more cycles, other protocols from their start."""
    if all(step["kind"] in ("triangle", "rezero") for step in steps):
        return [
            {**step, "cycles": times * int(_number(step, "cycles"))} if "cycles" in step else step for step in steps
        ]
    return steps * times


def protocols(
    low_mm: float, high_mm: float, step_s: float, stroke_samples: int = SAMPLES_A_STROKE
) -> list[tuple[str, list[Step]]]:
    """List protocols within a range of the input, each with its name.

    Parameters
    ----------
    low_mm, high_mm : float
        Range of the input.
    step_s : float
        Time between samples; it limits the speed of strokes.
    stroke_samples : int
        Least number of samples in a stroke.
    """
    span = high_mm - low_mm
    low, high = round(low_mm + EDGE * span, 4), round(high_mm - EDGE * span, 4)
    middle = round(0.5 * (low + high), 4)

    def speed(way_mm: float, seconds: float) -> float:
        return float(f"{abs(way_mm) / max(seconds, stroke_samples * step_s):.3g}")

    def triangle(a: float, b: float, seconds: float, cycles: int = 1) -> Step:
        return {
            "kind": "triangle",
            "from_mm": round(a, 4),
            "to_mm": round(b, 4),
            "speed_mm_s": speed(b - a, seconds),
            "cycles": cycles,
            "frames": "continuous",
        }

    def stairs(a: float, b: float, dwell_s: float) -> Step:
        return {
            "kind": "staircase",
            "from_mm": a,
            "to_mm": b,
            "steps": 6,
            "dwell_s": dwell_s,
            "speed_mm_s": speed(b - a, 12.0),
            "frames": "continuous",
        }

    def held(at: float, seconds: float) -> list[Step]:
        move: Step = {"kind": "move", "to_mm": at, "speed_mm_s": speed(span, 5.0)}
        return [move, {"kind": "hold", "at_mm": at, "seconds": seconds}]

    fast, small = triangle(low, high, 4.0), triangle(middle - 0.05 * span, middle + 0.05 * span, 4.0, 3)
    return [
        ("there and back", [triangle(low, high, 8.0)]),
        ("slowly there and back", [triangle(low, high, 30.0)]),
        ("fast there and back", [fast]),
        ("two speeds", [triangle(low, high, 4.0, 3), triangle(low, high, 20.0)]),
        ("reversals", [triangle(low, middle, 5.0, 2), triangle(middle, high, 5.0, 2)]),
        ("decreasing loops", [triangle(low + k * span / 10.0, high - k * span / 10.0, 6.0) for k in range(4)]),
        ("staircase with holds", [stairs(low, high, 3.0), stairs(high, low, 3.0)]),
        ("short hold", [fast, *held(high, 15.0)]),
        ("long hold", [fast, *held(high, 60.0)]),
        ("two speeds, holds and small loops", [fast, *held(high, 20.0), triangle(low, high, 16.0), small]),
        ("close fully", [triangle(low + 0.3 * span, low, 6.0)]),
        ("open fully", [triangle(high - 0.3 * span, high, 6.0)]),
        ("small loops", [small]),
        ("re-zero the stage, there and back", [REZERO, triangle(low, high, 8.0)]),
    ]

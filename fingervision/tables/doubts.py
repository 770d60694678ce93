"""Doubts about a table of another program: impossible or improbable values that the user is asked to confirm.

Each doubt has a name, by which the key `accept` in columns.toml confirms the values; a unit that the user states in
columns.toml is not doubted.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.number_columns import Numbers
from fingervision.tables.clock_leaps import clock_leaps, is_known_leap, usual_step, without_leaps
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import Question, Reading, asked, span

LEAST_RATIO, GREATEST_RATIO = 0.1, 100.0
"""Plausible ratio of the range of the gap to the range of the input. Compliant grippers have 0.3 to 50 (the published
gripper 10.4); a factor of 1000, from metres or micrometres labelled as millimetres, always leads out of this range."""
LEAST_INPUT_MM, GREATEST_INPUT_MM = 0.002, 300.0
"""Plausible range of the input. The encoder of a stage resolves a micrometre; no micro-gripper is driven by a third of
a metre."""
GREATEST_GAP_MM = 500.0
"""Largest plausible gap, beyond the field of view of any such set-up."""
USUAL_INPUT_MM, USUAL_GAP_MM = (0.02, 20.0), (0.1, 100.0)
"""Ranges of which at least one holds for a micro-gripper's input or gap. If both are smaller (or both larger), a
measurement in metres (or micrometres) that is called millimetres is by far more probable."""
LEAST_SPEED_MM_S, GREATEST_SPEED_MM_S = 2e-3, 50.0
USUAL_STEPS_S = (1e-3, 1.0)
"""Usual time between rows (s), judged together with the usual speed of the input during motions (mm/s). Usual set-ups
move at 0.01 to 2 mm/s and record 5 to 1000 rows per second; if both are slower (or faster) by a factor of a thousand,
times have another unit, or the log spans hours, which the user may confirm."""
FEWEST_FOR_SPEED = 20
LEAST_OVERLAP = 0.5
"""Smallest fraction of the rows with a gap that should have an input; with a smaller fraction, the two records hardly
overlap."""
EPSILON_MM = 1e-9


def doubts(
    columns: Mapping[str, Numbers], given: Entry, kind: str, runs: NDArray[np.intp] | None, *, dated: bool = False
) -> list[Question]:
    """List doubts about impossible or improbable values of a table.

    Parameters
    ----------
    columns : mapping of str to Numbers
        Columns by role, in mm, s and N.
    given : Entry
        Decisions of the user.
    kind : str
        `measured`, `drive` or `simulation`.
    runs : ndarray of int, shape (n,), or None
        Run number of each row.
    dated : bool
        Whether times were written as dates, so that the unit of the times is certain.
    """
    found: list[Question] = []
    given_units = set(given.units)
    inputs = columns["input"].value[columns["input"].present]
    travel = float(np.ptp(inputs)) if inputs.size else 0.0
    if travel == 0.0:
        if "constant_input" not in given.accept:
            value = f"{inputs[0]:g} mm in each of its {inputs.size} rows" if inputs.size else "without any number"
            found.append(Question(f"the input never changes ({value})", "accept=constant_input"))
        return found
    if "sizes" not in given.accept:
        found += _sizes(columns, travel, given_units)
    if kind == "measured" and "overlap" not in given.accept:
        found += _overlap(columns)
    if kind != "simulation" and "time" in columns:
        found += _times(columns, given, runs, dated=dated)
    return found


def _overlap(columns: Mapping[str, Numbers]) -> list[Question]:
    """State a doubt if the input is missing in most rows with a gap."""
    sides = [columns[name].present for name in ("left", "right") if name in columns]
    measured = columns["gap"].present if "gap" in columns else np.logical_and.reduce(sides)
    total = int(np.count_nonzero(measured))
    shared = int(np.count_nonzero(measured & columns["input"].present))
    if shared >= LEAST_OVERLAP * total:
        return []
    return [Question(f"only {shared} of {total} rows with a gap have an input", "accept=overlap")]


def _gap(columns: Mapping[str, Numbers]) -> NDArray[np.float64] | None:
    if "left" in columns and "right" in columns:
        both = columns["left"].present & columns["right"].present
        return np.asarray(columns["right"].value[both] - columns["left"].value[both])
    return columns["gap"].value[columns["gap"].present] if "gap" in columns else None


def _sizes(columns: Mapping[str, Numbers], travel: float, given_units: set[str]) -> list[Question]:
    """State a doubt if the range of the input, or of the gap beside that of the input, is implausible."""
    inputs = columns["input"].value[columns["input"].present]
    gap = _gap(columns)
    sides = given_units & {"gap", "left", "right"}
    largest = float(np.max(np.abs(gap))) if gap is not None and gap.size and not sides else 1.0
    sizes = ((travel, *USUAL_INPUT_MM), (largest, *USUAL_GAP_MM))
    unusual = all(size < low for size, low, _ in sizes) or all(size > high for size, _, high in sizes)
    if "input" not in given_units and (unusual or not LEAST_INPUT_MM <= travel <= GREATEST_INPUT_MM):
        words = f"with the stated unit, the input ranges over {travel:g} mm"
        plausible = _other_units("input", inputs, lambda size: LEAST_INPUT_MM <= size <= GREATEST_INPUT_MM)
        return [asked(words, plausible)]
    if gap is None or not gap.size or (sides and "input" in given_units):
        return []
    opening = float(np.ptp(gap))
    if "gap" in columns and not sides and largest > GREATEST_GAP_MM:
        words = f"with the stated unit, the gap is {span(gap, 'mm')}"
        return [asked(words, _other_units("gap", gap, lambda size: size < opening))]
    if opening == 0.0 or LEAST_RATIO <= opening / travel <= GREATEST_RATIO:
        return []
    readings: list[Reading] = []
    if "input" not in given_units:
        readings += _other_units("input", inputs, lambda size: LEAST_RATIO <= opening / size <= GREATEST_RATIO)[:-1]
    if "gap" in columns and not sides:
        readings += _other_units("gap", gap, lambda size: LEAST_RATIO <= size / travel <= GREATEST_RATIO)[:-1]
    words = (
        f"the gap ranges over {opening:g} mm while the input ranges over {travel:g} mm, {opening / travel:.3g} times "
        "as far: one of the two units cannot be right"
    )
    return [asked(words, [*readings, Reading("accept=sizes", f"both as stated, gap {span(gap, 'mm')}")])]


def _other_units(role: str, stated_mm: NDArray[np.float64], is_plausible: Callable[[float], bool]) -> list[Reading]:
    """Readings of lengths in mm whose numbers are metres or micrometres, where plausible; and as they are."""
    travel = float(np.ptp(stated_mm))
    return [
        *(
            Reading(f"units.{role}={unit}", span(size * stated_mm, "mm"))
            for unit, size in (("m", 1e3), ("um", 1e-3))
            if is_plausible(size * travel)
        ),
        Reading("accept=sizes", span(stated_mm, "mm")),
    ]


def _times(
    columns: Mapping[str, Numbers], given: Entry, runs: NDArray[np.intp] | None, *, dated: bool
) -> list[Question]:
    both = columns["time"].present & columns["input"].present
    time, inputs = columns["time"].value[both], columns["input"].value[both]
    of_run = np.zeros(time.size, dtype=np.intp) if runs is None else runs[both]
    if time.size < 2:
        return []
    same = np.diff(of_run) == 0
    steps = np.diff(time)
    found: list[Question] = []
    leaps = clock_leaps(time, dated=dated)
    leaps = leaps[same[leaps]]
    if leaps.size and "clock" not in given.words and "backward_time" not in given.accept:
        at = int(leaps[0]) + 1
        words = f"the time leaps {leaps.size} time(s), first from {time[at - 1]:g} to {time[at]:g} s"
        return [asked(words, _readings_of_leaps(time, steps, leaps))]
    if dated or "speed" in given.accept or "time" in given.units or time.size < FEWEST_FOR_SPEED:
        return found
    moving = same & (np.abs(np.diff(inputs)) > EPSILON_MM)
    seconds = float(np.sum(np.abs(steps[moving])))
    if not seconds > 0.0:
        return found
    speed = float(np.sum(np.abs(np.diff(inputs)[moving]))) / seconds
    step = float(np.median(steps[moving]))
    slow = speed < LEAST_SPEED_MM_S and step >= USUAL_STEPS_S[1]
    if slow or (speed > GREATEST_SPEED_MM_S and step < USUAL_STEPS_S[0]):
        unit, size = ("ms", 1e-3) if slow else ("s", 1e3)
        elapsed = time - time[0]
        words = f"with the stated unit of time, the input moves at {speed:.2g} mm/s with a row every {step:.2g} s"
        readings = [
            Reading(f"units.time={unit}", span(elapsed * size, "s")),
            Reading("accept=speed", span(elapsed, "s")),
        ]
        found.append(asked(words, readings))
    return found


def _readings_of_leaps(time: NDArray[np.float64], steps: NDArray[np.float64], leaps: NDArray[np.intp]) -> list[Reading]:
    """Readings of a time that leaps: the clock was set or ran over, the run began again, or rows are out of order."""
    through = without_leaps(time, leaps)
    continuous = Reading("clock=continuous", f"the clock was set, or its counter ran over: {span(through, 's')}")
    forward = bool(np.all(steps[leaps] > 0.0))
    if forward:
        return [continuous, Reading("clock=as_written", f"a pause: {span(time - time[0], 's')}")]
    if np.any(is_known_leap(steps[leaps], time)):
        order = "clock"
    else:
        order = "runs" if np.isclose(time[leaps + 1], time[0], atol=2.0 * usual_step(time)).all() else "accept"
    found = [
        continuous,
        Reading("runs=restart", f"{leaps.size + 1} runs"),
        Reading("accept=backward_time", f"rows out of order: {span(time - time.min(), 's')}"),
    ]
    return sorted(found, key=lambda each: not each.key.startswith(order))

"""Doubts about a table of another program: impossible or improbable values that the user is asked to confirm.

Each doubt has a name, by which the key `accept` in columns.toml confirms the values; a unit that the user states in
columns.toml is not doubted.
"""

import re
from collections.abc import Callable, Mapping
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.csv_columns import Numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import Question, Reading, asked, span
from fingervision.tables.times import clock_leaps, counts_days, is_epoch, is_known_leap, usual_step, without_leaps
from fingervision.tables.units import CANONICAL, factor, known_unit, written_multiple

FAR = 100.0
"""Least distance of a filler value from the median of the other values, as a multiple of their range: fillers such as
-9999 or 32767 are chosen so that no measured value comes near, and no motion jumps a hundred times its own range."""
LEAST = 900.0
"""Least size of a filler value, in the unit of the file: -999 and larger. A step from rest to rest may be a hundred
times the noise at rest, too."""
MOST_ROWS = 0.2
"""Largest fraction of a column's rows that may hold the filler value."""


def filler_value(values: Numbers) -> float | None:
    """Find the number that probably means no value; None if there is none.

    Parameters
    ----------
    values : Numbers
        A column of numbers, in the unit of the file.

    Examples
    --------
    >>> filler_value(Numbers.whole(np.array([0.6, 0.7, 0.8, -9999.0, 0.9, 1.0])))
    -9999.0
    >>> filler_value(Numbers.whole(np.array([0.6, 0.7, 0.8, 5.0, 0.9, 1.0]))) is None
    True
    """
    known = values.value[values.present]
    if known.size < 2:
        return None
    middle = float(np.median(known))
    furthest = float(known[int(np.argmax(np.abs(known - middle)))])
    others = known[known != furthest]
    if not others.size or known.size - others.size > MOST_ROWS * known.size:
        return None
    spread = float(np.ptp(others))
    is_far = abs(furthest) >= LEAST and abs(furthest - middle) > FAR * spread > 0.0
    return furthest if is_far else None


def dropped_out(values: Numbers) -> NDArray[np.bool_]:
    """Rows in which a column leaps to exactly zero and back, which no motion does: a drop-out.

    A leap is larger than twice the largest step between other rows; a stage that rests at zero arrives there by steps
    of the usual size. In a column with such leaps, zeros that last no longer are drop-outs too, unless the steps beside
    them become small: to lose a row does less harm than a wrong one.
    Zeros in more than `MOST_ROWS` of the rows are a state and no drop-outs.

    Examples
    --------
    >>> dropped_out(Numbers.whole(np.array([0.0, 0.1, 0.2, 0.3, 0.0, 0.3, 0.2, 0.1, 0.0]))).nonzero()[0]
    array([4])
    """
    known = np.flatnonzero(values.present)
    number = values.value[known]
    out = np.zeros(values.value.size, dtype=np.bool_)
    rest, zeros = np.flatnonzero(number != 0.0), np.flatnonzero(number == 0.0)
    if rest.size < 2 or not zeros.size:
        return out
    steps = np.abs(np.diff(number[rest]))
    usual = float(np.max(steps[np.diff(rest) == 1], initial=0.0))
    # `lengths[k]` zeros stand before row k of those that are not zero; the last, behind all of them.
    lengths = np.diff(np.concatenate([[-1], rest, [number.size]])) - 1
    inner = np.flatnonzero(lengths[1:-1]) + 1
    before, after = np.abs(number[rest[inner - 1]]), np.abs(number[rest[inner]])
    leaps = np.minimum(before, after) > 2.0 * usual
    if usual == 0.0 or not leaps.any():
        return out
    padded = np.concatenate([[0.0], steps, [0.0]])
    near = np.maximum(padded[inner - 1], padded[inner + 1])
    off = (before + after > near) & (lengths[inner] <= np.max(lengths[inner[leaps]]))
    ends = np.array([0, rest.size])[np.abs(number[rest[[0, -1]]]) > 2.0 * usual]
    dropped = zeros[np.isin(np.searchsorted(rest, zeros), np.concatenate([inner[leaps | off], ends]))]
    out[known[dropped]] = dropped.size <= MOST_ROWS * number.size
    return out


def without_filler(values: Numbers, stated: str) -> Numbers:
    """Mark the number that the user states as the filler value as missing; of zeros, only those that drop out."""
    try:
        filler = float(stated)
    except ValueError:
        return values
    if not isfinite(filler):
        return values
    held = dropped_out(values) if filler == 0.0 else values.value == filler
    return Numbers(np.where(held, 0.0, values.value), values.present & ~held)


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


UNITS = {
    "length": ("mm", "um", "m", "in", "nm", "cm"),
    "time": ("s", "ms", "us", "ns", "min", "h", "d"),
    "force": ("N", "mN", "kN"),
}
"""Units that are offered, the most usual first."""
TIME_STEPS_S = (2e-6, 2.0)
"""Time between rows (s) that is plausible: logs of stages have 5 to 1000 rows per second."""
FEWEST_COUNTS = 100
"""Range of whole numbers above which they may be an encoder's counts, whose size only the user knows."""
TIMES_TEN = re.compile(r"[x\u00d7*\u00b7]\s*(.+)")
"""A unit with a multiplication sign before it: `x10 um` may mean tens of micrometres, or numbers times ten."""


def unit_question(words: str, role: str, dimension: str, values: NDArray[np.float64]) -> Question:
    """Question for the unit of a column; each unit with which the numbers are plausible is a reading.

    Examples
    --------
    >>> unit_question("?", "gap", "length", np.array([0.0, 1.2])).key
    'units.gap=mm'
    >>> [each.key for each in unit_question("?", "gap", "length", np.array([0.0, 1200.0])).readings]
    ['units.gap=um', 'units.gap=SIZE um']
    >>> [each.key for each in unit_question("?", "gap", "length", np.array([0.5, 1200.0])).readings]
    ['units.gap=um']
    >>> unit_question("?", "time", "time", 20.0 * np.arange(5.0)).key
    'units.time=ms'
    """
    units = [unit for unit in UNITS[dimension] if _is_plausible(dimension, unit, values)] or [UNITS[dimension][0]]
    if dimension == "time" and counts_days(values):
        units = ["d"]
    readings = unit_readings(role, dimension, units, values)
    if dimension == "length" and values.size and np.ptp(values) >= FEWEST_COUNTS and np.all(values == np.rint(values)):
        readings.append(Reading(f"units.{role}=SIZE um", "counts, each worth SIZE um"))
    return asked(words, readings)


def unit_readings(role: str, dimension: str, units: list[str], values: NDArray[np.float64]) -> list[Reading]:
    """The readings of a column in each of several units; times are counted from the first."""
    if dimension == "time" and values.size:
        values = values - values[0]
    return [
        Reading(f"units.{role}={unit}", span(values * (factor(unit, dimension) or 1.0), CANONICAL[dimension]))
        for unit in units
    ]


def _is_plausible(dimension: str, unit: str, values: NDArray[np.float64]) -> bool:
    size = factor(unit, dimension)
    if size is None or values.size < 2:
        return unit == UNITS[dimension][0]
    if dimension == "length":
        return LEAST_INPUT_MM <= size * float(np.ptp(values)) <= GREATEST_INPUT_MM
    if dimension == "time":
        step = size * float(np.median(np.abs(np.diff(values))))
        return bool(is_epoch(size * float(values[0]))) or TIME_STEPS_S[0] <= step <= TIME_STEPS_S[1]
    return True


def wrong_unit(name: str, role: str, dimension: str, unit: str, values: NDArray[np.float64]) -> Question:
    """Question for a column whose stated unit is unknown or of another dimension."""
    words = f"'{name}' ({role}) must be a {dimension}, but its unit is '{unit}'"
    # A micro sign that was lost on the way is often a question mark.
    micro = known_unit(unit.replace("?", "µ").replace("\N{REPLACEMENT CHARACTER}", "µ"))
    if micro:
        return asked(words, unit_readings(role, dimension, [micro], values))
    times = TIMES_TEN.fullmatch(unit)
    if times is not None and factor(times[1], dimension) is not None:
        size, one = written_multiple(times[1])
        units = [f"{size:g} {one}", f"{1.0 / size:g} {one}"]
        return asked(f"{words}, which may have two meanings", unit_readings(role, dimension, units, values))
    example = {"length": "SIZE um", "time": "SIZE ms", "force": "SIZE mN"}[dimension]
    return Question(
        f"{words}: state what one unit is worth, with a number for SIZE, or another column as columns.{role}",
        f"units.{role}={example}",
    )

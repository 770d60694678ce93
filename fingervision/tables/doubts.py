"""Doubts about a table of another program: impossible or improbable values that the user is asked to confirm.

Each doubt has a name, by which the key `accept` in columns.toml confirms the values; a unit that the user states in
columns.toml is not doubted.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.number_columns import Numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import Question

LEAST_RATIO, GREATEST_RATIO = 0.1, 100.0
"""Plausible ratio of the range of the gap to the range of the input. Compliant grippers have 0.3 to 50 (the published
gripper 10.4); a factor of 1000, from metres or micrometres labelled as millimetres, always leads out of this range."""
LEAST_INPUT_MM, GREATEST_INPUT_MM = 0.002, 300.0
"""Plausible range of the input. The encoder of a stage resolves a micrometre; no micro-gripper is driven by a third of
a metre."""
GREATEST_GAP_MM = 500.0
"""Largest plausible gap, beyond the field of view of any such set-up."""
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
    if "sizes" not in given.accept and "input" not in given_units:
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
    if not LEAST_INPUT_MM <= travel <= GREATEST_INPUT_MM:
        words = "metres" if travel < LEAST_INPUT_MM else "micrometres"
        unit = "m" if travel < LEAST_INPUT_MM else "um"
        return [
            Question(
                f"with the stated unit, the input ranges over {travel:g} mm; the numbers look like {words} (if the "
                "stated unit is right, set accept=sizes)",
                f"units.input={unit}",
            )
        ]
    gap = _gap(columns)
    if gap is None or not gap.size or given_units & {"gap", "left", "right"}:
        return []
    opening = float(np.ptp(gap))
    if opening == 0.0 or LEAST_RATIO <= opening / travel <= GREATEST_RATIO:
        return []
    ratio = opening / travel
    return [
        Question(
            f"the gap ranges over {opening:g} mm while the input ranges over {travel:g} mm, {ratio:.3g} times as far: "
            "one of the two units cannot be right",
            f"units.{'input=m' if ratio > GREATEST_RATIO else 'gap=m'}",
        )
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
    back = np.flatnonzero(same & (steps < 0.0))
    if back.size and "backward_time" not in given.accept:
        at = int(back[0]) + 1
        restarts = np.isclose(time[back + 1], time[0], atol=2.0 * float(np.median(np.abs(steps)))).all()
        found.append(
            Question(
                f"the time decreases {back.size} time(s), first from {time[at - 1]:g} to {time[at]:g} s"
                + (" and starts again: runs=restart begins a new run at each of these rows" if restarts else "")
                + " (accept=backward_time sorts the rows by time)",
                "runs=restart" if restarts else "accept=backward_time",
            )
        )
        return found
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
        found.append(
            Question(
                f"with the stated unit of time, the input moves at {speed:.2g} mm/s with a row every {step:.2g} s; the "
                f"times look like {'milliseconds' if slow else 'seconds'} (if the stated unit is right, set "
                "accept=speed)",
                f"units.time={'ms' if slow else 's'}",
            )
        )
    return found

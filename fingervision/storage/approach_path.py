"""Reconstruct the path of an axis between readings at target positions, from the direction of approach of each."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

NOMINAL_S = 30.0
"""Assumed time between rows of a table without times. In a published log of a stage measured with a laser, the time
between readings (move, settle, average) is 28.5 s. Effects with time constants of a second or less are then correctly
treated as invisible."""
SWAPPED = 0.75
"""Fraction of the moves between targets that contradict the stated direction, above which the directions are considered
as interchanged. With correct directions, only the return moves of one-directional cycles contradict, one move in each
cycle."""
LONGEST_OVERSHOOT_MM = 0.5
"""Longest assumed overshoot beyond a target: the largest play in the catalogue of effects. The overshoot is shorter if
the targets are closer together, so that it does not pass a neighbouring target."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One reading at a target: position (None if missing), direction (+1 from below, -1 from above), cycle, time."""

    target_mm: float
    position_mm: float | None
    side: int
    cycle: int
    run: str = ""
    time_s: float | None = None
    u_random_mm: float | None = None


@dataclass(frozen=True, slots=True)
class PathRow:
    """A row of a measured table; a row without a gap is only a point on the path of the input."""

    input_mm: float
    gap_mm: float | None
    time_s: float
    run: str
    u_random_mm: float | None = None


def approach_path(readings: Sequence[Reading]) -> tuple[tuple[PathRow, ...], tuple[str, ...]]:
    """Sort readings in the order of travel, and add a row beyond a target wherever the axis must have overshot it.

    Parameters
    ----------
    readings : sequence of Reading
        Readings in any order; each target occurs once per run, cycle and direction.

    Returns
    -------
    rows : tuple of PathRow
        Rows, run after run, with increasing times within each run.
    notes : tuple of str
        Assumptions that were made, one sentence each.
    """
    timed = all(reading.time_s is not None for reading in readings)
    notes = []
    against, moves = _against(
        sorted(readings, key=lambda reading: (reading.run, _time(reading)) if timed else ("", 0.0))
    )
    if against > SWAPPED * moves:
        came = f"{against} of {moves} moves from target to target go against the stated direction"
        if timed:
            readings = [replace(reading, side=-reading.side) for reading in readings]
            notes.append(f"According to the times, {came}: the two directions were exchanged.")
        elif len({reading.side for reading in readings}) > 1:
            # A table with a single direction of approach may be sorted by its targets.
            notes.append(f"In the order of the rows, {came}: are the two directions exchanged in the table?")
    targets = np.unique([reading.target_mm for reading in readings])
    closest = float(np.min(np.diff(targets))) if targets.size > 1 else LONGEST_OVERSHOOT_MM
    beyond = min(LONGEST_OVERSHOOT_MM, closest)
    rows: list[PathRow] = []
    added = 0
    for run in dict.fromkeys(reading.run for reading in readings):
        mine = [reading for reading in readings if reading.run == run]
        ordered = sorted(mine, key=_time) if timed else sorted(mine, key=_travel)
        path, times = _with_overshoots(ordered, beyond, timed)
        added += len(path) - len(ordered)
        rows += [replace(row, time_s=time) for row, time in zip(path, times, strict=True)]
    if not timed:
        notes.append(
            "The table has no times: within a cycle, targets approached from below were taken in ascending order, then "
            f"those from above in descending order, one row every {NOMINAL_S:g} s. Rates and time constants of the "
            f"report refer to these assumed times."
        )
    if added:
        notes.append(
            f"{added} rows without a gap were added {beyond:g} mm beyond a target, because the stated side of "
            f"approach means that the stage came from there."
        )
    return tuple(rows), tuple(notes)


def _against(ordered: Sequence[Reading]) -> tuple[int, int]:
    """Number of moves between targets that contradict the stated direction of approach, and total number of moves."""
    moves = [(b.target_mm - a.target_mm) * b.side for a, b in pairwise(ordered) if a.run == b.run]
    return sum(move < 0.0 for move in moves), sum(move != 0.0 for move in moves)


def _time(reading: Reading) -> float:
    return 0.0 if reading.time_s is None else reading.time_s


def _travel(reading: Reading) -> tuple[int, int, float]:
    """Sort key: cycle, then approaches from below before those from above, then the direction of travel."""
    return reading.cycle, -reading.side, reading.side * reading.target_mm


def _with_overshoots(ordered: Sequence[Reading], beyond: float, timed: bool) -> tuple[list[PathRow], list[float]]:
    """Rows of a run with their times; an added overshoot has the mean time of its neighbouring rows."""
    path: list[PathRow] = []
    times: list[float] = []
    clock = [_time(reading) for reading in ordered]
    usual = float(np.median(np.diff(clock))) if timed and len(clock) > 1 else NOMINAL_S
    for reading, time in zip(ordered, clock, strict=True):
        came_from = path[-1].input_mm if path else None
        if came_from is None or reading.side * (reading.target_mm - came_from) <= 0.0:
            path.append(PathRow(reading.target_mm - reading.side * beyond, None, 0.0, reading.run))
            times.append((times[-1] + time) / 2.0 if times else time - usual / 2.0)
        path.append(PathRow(reading.target_mm, reading.position_mm, 0.0, reading.run, reading.u_random_mm))
        times.append(time)
    if not timed:
        times = [NOMINAL_S * k for k in range(len(path))]
    return path, times

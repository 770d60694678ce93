"""Path of the input: rows without a gap, readings taken at rest, and commands that hold until they jump."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array, Flags, History, InputPath
from fingervision.domain.measured_table import MeasuredTable

AT_REST_S = 5.0
"""Rows this far apart are separate readings: ISO 230-2 lets a stage stand for some seconds at each target, while
cameras and data loggers that follow a motion record it at least every few seconds."""
AT_REST_REVISITED_S = 1.0
"""The same where the rows come back to exactly the same inputs: these are set-points and no samples of a motion."""
REVISITED_SHARE = 0.5
"""Share of the rows whose exact input stands in another row too, above which a record is one of set-points."""
OVERSHOOT = 0.5
"""Overshoot beyond an outermost target, over the distance of its neighbour: any larger than the play is as good."""
ARRIVED = 0.5
"""Share of the time between two readings after which the stage has arrived at the later one's input."""
FINE_STEPS = 8
"""Points of the path a sample after a command's jump, which takes one of them: so finely a delay places it."""
FINE_S = 1.5
"""Time after a jump for which the path is so fine: longer than the longest delay of the catalogue."""


def readings_at_rest(table: MeasuredTable) -> Flags:
    """Whether the stage moved, arrived and waited before each row was read, instead of being read in motion.

    Returns
    -------
    ndarray of bool, shape (m,)
        For each row of the path; False at the first row of each run.
    """
    input_mm, time_s, runs = recorded(table)
    out = np.zeros(input_mm.size, dtype=bool)
    if time_s is None:
        return out
    apart = AT_REST_REVISITED_S if _revisits(input_mm, runs) else AT_REST_S
    for run in runs:
        out[run.start + 1 : run.stop] = np.diff(time_s[run]) >= apart
    return out


def recorded(table: MeasuredTable) -> tuple[Array, Array | None, tuple[slice, ...]]:
    """All rows with an input: input and time, each of shape (m,), and the runs."""
    along = table.path
    if along is None:
        return table.input_mm, table.time_s, table.runs
    return along.input_mm, along.time_s, along.runs


def _revisits(input_mm: Array, runs: tuple[slice, ...]) -> bool:
    """Whether most rows return to an earlier input of the stage; a row that only waits does not count."""
    visits = np.concatenate([input_mm[run][np.flatnonzero(np.diff(input_mm[run], prepend=np.inf))] for run in runs])
    _, counts = np.unique(visits, return_counts=True)
    return float(np.sum(counts[counts > 1])) > REVISITED_SHARE * visits.size


def turning_readings(table: MeasuredTable) -> NDArray[np.intp]:
    """Rows of the path that were read at rest at the previous row's input, where the stage reverses.

    ISO 230-2 cycles read the outermost target twice: in between the stage overshoots it and returns from the other
    side.
    """
    input_mm, _, runs = recorded(table)
    rest = readings_at_rest(table)
    found = []
    for run in runs:
        for i in range(run.start + 2, run.stop - 1):
            if not rest[i] or input_mm[i] != input_mm[i - 1]:
                continue
            if (input_mm[i - 1] - input_mm[i - 2]) * (input_mm[i + 1] - input_mm[i]) < 0.0:
                found.append(i)
    return np.array(found, dtype=np.intp)


def input_path(
    table: MeasuredTable, history: History, along_mm: Array, *, commanded: bool, overshoots: bool = False
) -> InputPath | None:
    """Build the path that effects with memory follow.

    Parameters
    ----------
    table : MeasuredTable
        The rows.
    history : History
        Of the measured rows.
    along_mm : ndarray of float, shape (m,)
        Smoothed input of every recorded row.
    commanded : bool
        Whether the input is a command that keeps its value until it jumps.
    overshoots : bool
        Whether the stage ran over beyond its targets where it turned between two readings of the same one.

    Returns
    -------
    InputPath or None
        None where the measured rows say it all.
    """
    _, time_s, runs = recorded(table)
    if time_s is None:
        return None
    rows = np.arange(along_mm.size) if table.path is None else table.path.rows
    rest = readings_at_rest(table)
    if table.path is None and not commanded and not rest.any():
        return None
    over = set(turning_readings(table).tolist()) if overshoots else set[int]()
    owner_of = np.full(along_mm.size, -1, dtype=np.intp)
    owner_of[rows] = np.arange(rows.size)
    inputs: list[float] = []
    times: list[float] = []
    owners: list[int] = []
    place = np.zeros(along_mm.size, dtype=np.intp)
    path_runs: list[slice] = []
    for run in runs:
        begin, jumped_s = len(inputs), -np.inf
        for i in range(run.start, run.stop):
            step_s = time_s[i] - time_s[i - 1] if i > run.start else 0.0
            if i in over:
                inputs.append(along_mm[i] + OVERSHOOT * (along_mm[i - 1] - along_mm[i - 2]))
                times.append(time_s[i - 1] + 0.5 * ARRIVED * step_s)
                owners.append(-1)
            if rest[i]:
                inputs.append(along_mm[i])
                times.append(time_s[i - 1] + ARRIVED * step_s)
                owners.append(int(owner_of[i]))
            elif commanded and i > run.start:
                jumps = along_mm[i] != along_mm[i - 1]
                jumped_s = time_s[i] if jumps else jumped_s
                if jumps or time_s[i] - jumped_s < FINE_S:
                    # A command holds its value until the sample at which it stands changed.
                    inputs += [along_mm[i - 1]] * (FINE_STEPS - 1)
                    times += [time_s[i - 1] + step_s * k / FINE_STEPS for k in range(1, FINE_STEPS)]
                    owners += [int(owner_of[i - 1])] * (FINE_STEPS - 1)
            place[i] = len(inputs)
            inputs.append(along_mm[i])
            times.append(time_s[i])
            owners.append(int(owner_of[i]))
        path_runs.append(slice(begin, len(inputs)))
    along = replace(history, input_mm=np.array(inputs), time_s=np.array(times), runs=tuple(path_runs))
    found: NDArray[np.intp] = place[rows]
    return InputPath(along, found, np.array(owners, dtype=np.intp))


def dwell_s(table: MeasuredTable) -> float:
    """Shortest time for which the stage was at rest before a reading (s); 0 where any row was read in motion."""
    _, time_s, runs = recorded(table)
    rest = readings_at_rest(table)
    firsts = np.array([run.start for run in runs])
    if time_s is None or not np.delete(rest, firsts).all() or rest.size == firsts.size:
        return 0.0
    steps = np.concatenate([np.diff(time_s[run]) for run in runs])
    return (1.0 - ARRIVED) * float(np.min(steps))

"""Path of the input between the rows of a table: turns, rows without a gap, readings at rest, and held commands."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array, Flags, History, InputPath
from fingervision.domain.measured_table import MeasuredTable
from fingervision.motion.corners import Corner, corners
from fingervision.motion.log_path import LogPath

# Where the stage turned between two rows, as far as the rows beside the reversals show it.

SIGMA = 0.5
"""Standard deviation of a place before the gap is looked at, as a share of its range."""
MOST_TURNS = 200
"""Number of reversals above which their places are left to the noise: they average out, and each costs a column."""


@dataclass(frozen=True, eq=False)
class UnseenTurns:
    """Corners of the motion between the rows, and where the stage turned at the reversals among them.

    A stage that stops for a moment, or slows down before it reverses, turns between the farther row beside the reversal
    and the place at which the continued motions meet. An effect with memory, such as a play, keeps this place until the
    play is taken up, so that the gap tells where it was.

    Parameters
    ----------
    corners : tuple of Corner
        The corners, sorted by row.
    short_by : tuple of float
        For each of `reversals`, share of the way from the meeting place back to the row at which the stage turned.
    random : bool
        Whether the places are random effects, so that they contribute to the uncertainty of the effects.
    """

    corners: tuple[Corner, ...]
    short_by: tuple[float, ...] = ()
    random: bool = False

    def __post_init__(self) -> None:
        if not self.short_by:
            object.__setattr__(self, "short_by", tuple(corner.short_by[0] for corner in self.reversals))

    @cached_property
    def reversals(self) -> tuple[Corner, ...]:
        """The corners at which the stage reversed at a place that the rows do not determine."""
        return tuple(corner for corner in self.corners if corner.free)

    @property
    def ranges(self) -> Array:
        """Least and largest `short_by` of each reversal; shape (reversals, 2)."""
        return np.array([corner.short_by for corner in self.reversals]).reshape(-1, 2)

    @property
    def sigmas(self) -> Array:
        """Standard deviation of each `short_by` before the gap is looked at; shape (reversals,)."""
        return np.asarray(SIGMA * (self.ranges[:, 1] - self.ranges[:, 0]))

    @property
    def price(self) -> float:
        """-2 log of the probability of the places before the gap is looked at, up to a constant."""
        return float(np.sum(((np.array(self.short_by) - self.ranges[:, 0]) / self.sigmas) ** 2))

    @property
    def uncertain(self) -> int:
        """Number of reversals whose place is estimated from the gap."""
        return len(self.reversals) if len(self.reversals) <= MOST_TURNS else 0

    @cached_property
    def points(self) -> Mapping[int, list[tuple[float, float]]]:
        """Times and inputs of the points of the path that follow a row, by the row's index."""
        shares = dict(zip(self.reversals, self.short_by, strict=True))
        return {corner.after: corner.points(shares.get(corner, corner.short_by[0])) for corner in self.corners}

    def turned(self, short_by: Array) -> "UnseenTurns":
        """Return the same corners with other turning points; shape (reversals,)."""
        return replace(self, short_by=tuple(short_by.tolist()))


NO_TURNS = UnseenTurns(())
"""A motion without corners between its rows."""


AT_REST_S = 5.0
"""Shortest time between rows that count as separate readings at rest: in ISO 230-2 a stage rests for some seconds at
each target, while cameras and data loggers record a motion at least every few seconds."""
AT_REST_REVISITED_S = 1.0
"""Shortest time between readings at rest if rows return to exactly equal inputs: such inputs are set-points, not
samples of a motion."""
AT_REST_SHARE = 0.5
"""Share of rows read at rest above which rows give no information on their neighbours' input."""
REVISITED_SHARE = 0.5
"""Share of rows with an input that also occurs in another row, above which the record consists of set-points."""
OVERSHOOT = 0.5
"""Overshoot beyond an outermost target, as a share of the distance to its neighbour: any value larger than the play has
the same effect."""
ARRIVED = 0.5
"""Share of the time between two readings after which the stage has arrived at the later reading's input."""
FINE_STEPS = 8
"""Points of the path per sample after a command's jump: the resolution with which a delay places the jump."""
FINE_S = 1.5
"""Time after a jump for which the path has `FINE_STEPS` points per sample: longer than the longest delay of the
catalogue."""


def readings_at_rest(table: MeasuredTable) -> Flags:
    """Whether the stage moved, arrived and rested before each row was read, instead of being read in motion.

    Returns
    -------
    ndarray of bool, shape (m,)
        One value for each row of the path; False for the first row of each run.
    """
    input_mm, time_s, runs = recorded(table)
    out = np.zeros(input_mm.size, dtype=bool)
    if time_s is None:
        return out
    apart = AT_REST_REVISITED_S if _revisits(input_mm, runs) else AT_REST_S
    for run in runs:
        out[run.start + 1 : run.stop] = np.diff(time_s[run]) >= apart
    return out


def mostly_at_rest(table: MeasuredTable) -> bool:
    """Whether most rows that follow another row of their run were read at rest."""
    _, _, runs = recorded(table)
    follows = np.delete(readings_at_rest(table), [run.start for run in runs])
    return bool(follows.size and np.mean(follows) > AT_REST_SHARE)


def recorded(table: MeasuredTable) -> tuple[Array, Array | None, tuple[slice, ...]]:
    """All rows with an input: input and time, each of shape (m,), and the runs."""
    along = table.path
    if along is None:
        return table.input_mm, table.time_s, table.runs
    return along.input_mm, along.time_s, along.runs


def _revisits(input_mm: Array, runs: tuple[slice, ...]) -> bool:
    """Whether most rows return to an earlier input of the stage; rows in which the stage only waits do not count."""
    visits = np.concatenate([input_mm[run][np.flatnonzero(np.diff(input_mm[run], prepend=np.inf))] for run in runs])
    _, counts = np.unique(visits, return_counts=True)
    return float(np.sum(counts[counts > 1])) > REVISITED_SHARE * visits.size


def unseen_turns(table: MeasuredTable, history: History, along_mm: Array, *, commanded: bool) -> UnseenTurns:
    """Find the corners of a motion between the rows; none of a command, or between readings at rest.

    Parameters
    ----------
    table : MeasuredTable
        The measured table.
    history : History
        History of the measured rows.
    along_mm : ndarray of float, shape (m,)
        Smoothed input of every recorded row.
    commanded : bool
        Whether the input is a command that keeps its value until it jumps.
    """
    _, time_s, runs = recorded(table)
    if time_s is None or commanded:
        return NO_TURNS
    rest = readings_at_rest(table)
    found = corners(along_mm, time_s, runs, history.input_sigma_mm)
    return UnseenTurns(tuple(corner for corner in found if not rest[corner.after : corner.after + 2].any()))


def turning_readings(table: MeasuredTable) -> NDArray[np.intp]:
    """Rows of the path that were read at rest at the previous row's input, where the stage reverses.

    In ISO 230-2 cycles the outermost target is read twice: between the readings the stage overshoots the target and
    returns from the other side.
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
    table: MeasuredTable,
    history: History,
    along_mm: Array,
    *,
    commanded: bool,
    turns: UnseenTurns,
    overshoots: bool = False,
) -> InputPath | None:
    """Build the path on which effects with memory depend.

    Parameters
    ----------
    table : MeasuredTable
        The measured table.
    history : History
        History of the measured rows.
    along_mm : ndarray of float, shape (m,)
        Smoothed input of every recorded row.
    commanded : bool
        Whether the input is a command that keeps its value until it jumps.
    turns : UnseenTurns
        Corners of the motion between the rows, and where the stage turned.
    overshoots : bool
        Whether the stage went beyond its targets where it reversed between two readings of the same target.

    Returns
    -------
    InputPath or None
        None if the measured rows contain the whole path.
    """
    _, time_s, runs = recorded(table)
    if time_s is None:
        return None
    rows = table.path_rows
    rest = readings_at_rest(table)
    between = turns.points
    if table.path is None and not commanded and not rest.any() and not between:
        return None
    step_s = np.diff(time_s, prepend=time_s[0])
    owner_of = np.full(along_mm.size, -1, dtype=np.intp)
    owner_of[rows] = np.arange(rows.size)
    # Points with their places in the path, in rows: an overshoot and a rest lie before a row, a corner lies after it.
    over = turning_readings(table) if overshoots else np.zeros(0, dtype=np.intp)
    beyond_mm = along_mm[over] + OVERSHOOT * (along_mm[over - 1] - along_mm[over - 2])
    rested = np.flatnonzero(rest)
    # A command keeps its old value until the sample at which the new value is recorded.
    held = np.repeat(_beside_jumps(along_mm, time_s, runs, rest) if commanded else rested[:0], FINE_STEPS - 1)
    share = np.resize(np.arange(1, FINE_STEPS) / FINE_STEPS, held.size)
    turned = [(row, at_s, at_mm) for row, points in between.items() for at_s, at_mm in points]
    after, turned_s, turned_mm = np.array(turned, dtype=np.float64).reshape(-1, 3).T
    nobody = np.full(over.size + after.size, -1)
    places = np.concatenate([np.arange(along_mm.size), over - 0.75, rested - 0.5, held - 0.5, after + 0.5])
    inputs = np.concatenate([along_mm, beyond_mm, along_mm[rested], along_mm[held - 1], turned_mm])
    times = np.concatenate(
        [
            time_s,
            time_s[over - 1] + 0.5 * ARRIVED * step_s[over],
            time_s[rested - 1] + ARRIVED * step_s[rested],
            time_s[held - 1] + step_s[held] * share,
            turned_s,
        ]
    )
    owners = np.concatenate([owner_of, nobody[: over.size], owner_of[rested], owner_of[held - 1], nobody[over.size :]])
    order = np.argsort(places, kind="stable")
    borders = np.searchsorted(places[order], [run.start for run in runs] + [along_mm.size]).tolist()
    path_runs = tuple(slice(begin, end) for begin, end in pairwise(borders))
    along = replace(history, input_mm=inputs[order], time_s=times[order], runs=path_runs)
    return InputPath(along, np.searchsorted(places[order], rows), owners[order])


def log_at(log: LogPath, values: Array, table: MeasuredTable) -> Array:
    """Read values along the path of a log at every recorded row; beyond the ends of a run their slope continues.

    Parameters
    ----------
    log : LogPath
        The path.
    values : ndarray of float, shape (p,)
        Values at its points.
    table : MeasuredTable
        The table, with times.

    Returns
    -------
    ndarray of float, shape (m,)
    """
    input_mm, time_s, runs = recorded(table)
    out = np.empty(input_mm.size)
    for run, points in zip(runs, log.runs(table.run_names), strict=True):
        if time_s is not None:
            out[run] = continued(time_s[run], log.drive.time_s[points], values[points])
    return out


def continued(at_s: Array, time_s: Array, values: Array) -> Array:
    """Interpolate values at rising times; beyond the first and the last time their slope continues."""
    out = np.interp(at_s, time_s, values)
    apart = np.flatnonzero(np.diff(time_s) > 0.0)
    for end, k, outside in ((0, apart[:1], at_s < time_s[0]), (-1, apart[-1:], at_s > time_s[-1])):
        slope = np.diff(values)[k] / np.diff(time_s)[k]
        out += np.where(outside, slope.sum() * (at_s - time_s[end]), 0.0)
    return out


def log_input_path(log: LogPath, table: MeasuredTable, history: History) -> InputPath:
    """Join the path between the rows of a log with the measured rows, so that effects with memory see both.

    Parameters
    ----------
    log : LogPath
        The path.
    table : MeasuredTable
        The measured table, with times.
    history : History
        History of the measured rows, with the input of the path.
    """
    inputs, times, owners, rows, runs = [], [], [], [], []
    begin = 0
    for run, points in zip(history.runs, log.runs(table.run_names), strict=True):
        time_s, path_s = history.times[run], log.drive.time_s[points]
        during = slice(*np.searchsorted(path_s, [time_s[0], time_s[-1]]))
        every_s = np.concatenate([path_s[during], time_s])
        order = np.argsort(every_s, kind="stable")
        every_s = every_s[order]
        inputs.append(np.concatenate([log.drive.input_mm[points][during], history.input_mm[run]])[order])
        times.append(every_s)
        middles_s = 0.5 * (time_s[1:] + time_s[:-1])
        owners.append(run.start + np.searchsorted(middles_s, every_s, side="right"))
        rows.append(begin + np.flatnonzero(order >= order.size - time_s.size))
        runs.append(slice(begin, begin + order.size))
        begin += order.size
    along = replace(history, input_mm=np.concatenate(inputs), time_s=np.concatenate(times), runs=tuple(runs))
    return InputPath(along, np.concatenate(rows), np.concatenate(owners))


def _beside_jumps(along_mm: Array, time_s: Array, runs: tuple[slice, ...], rest: Flags) -> NDArray[np.intp]:
    """Rows at which a command jumps, and the rows soon after them, without the first row of a run."""
    found = []
    for run in runs:
        jumps = np.diff(along_mm[run], prepend=along_mm[run.start]) != 0.0
        jumped_s = np.maximum.accumulate(np.where(jumps, time_s[run], -np.inf))
        near = jumps | (time_s[run] - jumped_s < FINE_S)
        near[0] = False
        found.append(run.start + np.flatnonzero(near & ~rest[run]))
    return np.concatenate(found)


def dwell_s(table: MeasuredTable) -> float:
    """Shortest time for which the stage was at rest before a reading (s); 0 if any row was read in motion."""
    _, time_s, runs = recorded(table)
    rest = readings_at_rest(table)
    firsts = np.array([run.start for run in runs])
    if time_s is None or not np.delete(rest, firsts).all() or rest.size == firsts.size:
        return 0.0
    steps = np.concatenate([np.diff(time_s[run]) for run in runs])
    return (1.0 - ARRIVED) * float(np.min(steps))

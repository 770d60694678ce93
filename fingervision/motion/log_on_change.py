"""Logs that have a row only when the position changes: what the stage did between two rows that are far apart.

EPICS monitors, Bluesky, Tango and many controllers record on change. While the stage rests, such a log has no row; a
straight line across the rest would let the stage creep to the first position of the next motion.
"""

from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array

FEWEST_ROWS = 20
"""Least number of rows of a run: a table of the corners of a motion has fewer."""
LONG = 3.0
"""Least duration of a rest, in multiples of the time between rows during motions. A motion that goes on across a
missing row takes two."""
AS_FAR = 1.5
"""Largest change across a rest, in multiples of the next change: the stage sets out within the last row's time, and a
motion that went on across the gap would have gone `LONG` times as far."""


LAST_DIGITS = 2.0
"""Largest change at rest, in multiples of the smallest change of the log."""
ROWS_AT_REST = 6
"""Number of rows added at either end of a rest: smoothing and the search for corners look at as many."""


def with_rests(drive: DriveHistory) -> tuple[DriveHistory, int]:
    """Add rows to the rests of a log on change, up to one row's time before the first row of the next motion.

    A log is taken to be written on change if no position is repeated from one row to the next, if rows are missing for
    `LONG` times the usual time, and if each such gap ends with a change that is no larger than that between two rows of
    the motion which it begins.

    Parameters
    ----------
    drive : DriveHistory
        The log.

    Returns
    -------
    DriveHistory, int
        The log with rows in its rests, and the number of rests; the log itself and 0 if it is not written on change.
    """
    if drive.force_n is not None:
        return drive, 0  # a force is sampled, and a position beside it has a row at each sample
    names = drive.run or ("",) * drive.time_s.size
    begin, rests = 0, 0
    time_s, input_mm, run = [], [], []
    for name, group in groupby(names):
        rows = slice(begin, begin + len(list(group)))
        begin = rows.stop
        found = _rests(drive.time_s[rows], drive.input_mm[rows])
        if found is None:
            return drive, 0
        at_s, at_mm = _filled(drive.time_s[rows], drive.input_mm[rows], *found)
        time_s.append(at_s)
        input_mm.append(at_mm)
        run += [name] * at_s.size
        rests += found[0].size
    if rests == 0:
        return drive, 0
    run_of = None if drive.run is None else tuple(run)
    return DriveHistory(np.concatenate(time_s), np.concatenate(input_mm), run_of), rests


def _rests(time_s: Array, input_mm: Array) -> tuple[NDArray[np.intp], float] | None:
    """Rows after which the stage rests, and the time between rows of a motion (s); None for another kind of log."""
    if time_s.size < FEWEST_ROWS:
        return None
    steps_s, changes = np.diff(time_s), np.diff(input_mm)
    if np.any(changes == 0.0):
        return None
    row_s = float(np.median(steps_s))
    long = np.flatnonzero(steps_s > LONG * row_s)
    long = long[long < changes.size - 1]
    change, onward = changes[long], changes[long + 1]
    # At rest, the last digit of the position may go to and fro.
    begins = np.abs(change) > LAST_DIGITS * float(np.min(np.abs(changes)))
    sets_out = (change * onward > 0.0) & (np.abs(change) <= AS_FAR * np.abs(onward))
    return (long, row_s) if bool(np.all(sets_out[begins])) else None


def _filled(time_s: Array, input_mm: Array, rests: NDArray[np.intp], row_s: float) -> tuple[Array, Array]:
    """Repeat the position in rows at the beginning and at the end of each rest."""
    count = np.arange(1, ROWS_AT_REST + 1)
    begins_s, ends_s = time_s[rests][:, None], time_s[rests + 1][:, None]
    held_s = np.concatenate([begins_s + row_s * count, ends_s - row_s * count[::-1]], axis=1)
    after_s = np.concatenate([begins_s + row_s * count, begins_s + row_s * count], axis=1)
    # In a short rest, the rows of its end would lie before those of its beginning.
    later = np.arange(held_s.shape[1]) >= ROWS_AT_REST
    kept = (held_s < ends_s - 0.5 * row_s) & (~later | (held_s > after_s[:, -1:] + 0.5 * row_s))
    values = np.broadcast_to(input_mm[rests][:, None], held_s.shape)
    every_s = np.concatenate([time_s, held_s[kept]])
    order = np.argsort(every_s, kind="stable")
    return every_s[order], np.concatenate([input_mm, values[kept]])[order]

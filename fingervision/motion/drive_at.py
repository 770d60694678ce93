"""State of the drive (input, run, force) at the time of a frame, and the jumps of its log, in which it is unknown."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.motion.encoder import differences, input_sigma
from fingervision.motion.encoder_path import CORNER, FEWEST, corners_between_rows

# Intervals of a log in which the stage jumps between two rest positions, so that its position is unknown.

STANDS = 0.1
"""Change of the log in a neighbouring interval, relative to the jump, below which the stage is at rest there."""
AT_REST = 2
"""Least number of intervals at rest on either side of a jump. A table that lists only the corners of a motion has a
single interval at rest between two ramps, and its ramps are real motions, not jumps.
"""
ENCODER_STEPS = 1.5
"""Number of encoder steps above which a change may be a jump: the reading of a slowly moving stage changes by single
steps, and seems to be at rest in between.
"""


@lru_cache(maxsize=4)
def jumps(drive: DriveHistory) -> NDArray[np.bool_]:
    """Whether the stage jumps between one row and the next, and rests before and after the jump; shape (n - 1,).

    The log does not show when within the interval, and how fast, the stage moved.

    Parameters
    ----------
    drive : DriveHistory
        The log.
    """
    moved = np.abs(np.diff(drive.input_mm))
    if drive.run is not None:
        names = np.array(drive.run)
        moved = np.where(names[1:] == names[:-1], moved, np.inf)  # no rest between two runs
    if not moved.size:
        return np.zeros(0, dtype=np.bool_)
    _, step_mm = input_sigma(drive.input_mm, (slice(0, drive.input_mm.size),), drive.time_s)
    beside = np.zeros(moved.size)
    for by in range(1, AT_REST + 1):
        beside = np.maximum(beside, np.append(moved[by:], np.full(min(by, moved.size), np.inf)))
        beside = np.maximum(beside, np.append(np.full(min(by, moved.size), np.inf), moved[:-by]))
    return np.isfinite(moved) & (moved > ENCODER_STEPS * step_mm) & (beside < STANDS * moved)


def within_jump(drive: DriveHistory, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether instants on the drive's clock lie between the two rows of a jump; shape (n,)."""
    after = np.searchsorted(drive.time_s, time_s, side="left")
    at_row = drive.time_s[np.minimum(after, drive.time_s.size - 1)] == time_s
    inside = (after > 0) & (after < drive.time_s.size) & ~at_row
    if drive.time_s.size < 2:
        return np.asarray(inside)
    return np.asarray(inside & jumps(drive)[np.clip(after - 1, 0, drive.time_s.size - 2)])


KNOWN = 2.0
"""Distance between curve and chord in the middle of an interval, in standard uncertainties of the curve there, above
which the rows know the curve. For a sine it is 0.9 / (phase between two rows)^2: 36 for 5 Hz at 200 rows a second.
Beside a corner, or between two corners, it is at most 1.
"""


Curve = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@lru_cache(maxsize=4)
def _curves(drive: DriveHistory) -> tuple[NDArray[np.intp], tuple[Curve, ...]]:
    """Curves through the rows, and the number of the curve of each interval; -1 means the chord.

    The curve is Akima's through the rows of a run, and, where two straight strokes meet between two rows, these
    strokes.

    A chord lies inside every bend of the motion by up to an eighth of the rows' second difference: by 0.6 um for a
    stroke of 0.4 mm at 5 Hz and 200 rows a second, which looks like a lever's error or an end stop. A chord across a
    reversal at a constant speed of 0.36 mm/s, in a log of 50 rows a second, hides up to 3.6 um of the stroke, by which
    a play seems smaller.
    """
    from scipy.interpolate import Akima1DInterpolator  # half a second that is spent only with a log

    chosen, curves = np.full(max(drive.time_s.size - 1, 0), -1, dtype=np.intp), list[Curve]()
    runs = _runs(drive)
    sigma_mm, _ = input_sigma(drive.input_mm, runs, drive.time_s)
    for run in runs:
        if run.stop - run.start < FEWEST:
            continue
        time_s, input_mm = drive.time_s[run], drive.input_mm[run]
        curve = Akima1DInterpolator(time_s, input_mm)
        chord_mm = 0.5 * (input_mm[1:] + input_mm[:-1])
        bend_mm = np.abs(curve(0.5 * (time_s[1:] + time_s[:-1])) - chord_mm)
        fourth = np.abs(np.pad(differences(input_mm, time_s, 4), 2, mode="edge"))
        is_known = bend_mm > KNOWN * CORNER * (fourth[1:] + fourth[:-1])
        chosen[run.start : run.stop - 1][is_known] = len(curves)
        curves.append(curve)
        for corner in corners_between_rows(time_s, input_mm, np.full(time_s.size, sigma_mm)):
            # Two equal rows are a short stop: a stage in motion is seldom at the same place on both sides of a corner.
            if abs(input_mm[corner.last] - input_mm[corner.first]) > np.spacing(np.max(np.abs(input_mm))):
                chosen[run.start + corner.first] = len(curves)
                curves.append(corner.input_mm)
    return chosen, tuple(curves)


def _runs(drive: DriveHistory) -> tuple[slice, ...]:
    names = np.zeros(drive.time_s.size) if drive.run is None else np.array(drive.run)
    borders = [0, *(1 + np.flatnonzero(names[1:] != names[:-1])).tolist(), drive.time_s.size]
    return tuple(slice(begin, end) for begin, end in pairwise(borders))


@dataclass(frozen=True, slots=True)
class DriveState:
    """Recorded input, run and force at one instant.

    Parameters
    ----------
    run : str
        Name of the run; empty where the drive table has no runs.
    input_mm : float
        Input displacement.
    force_n : float or None
        Force at the drive, where it was recorded.
    """

    run: str
    input_mm: float
    force_n: float | None


def drive_at(drive: DriveHistory, time_s: float) -> DriveState | None:
    """Interpolate the drive between the two samples that bracket an instant.

    The input follows a curve through the rows where these know the curve, and is linear elsewhere; the force is linear.
    Nothing is extrapolated: before the first sample, after the last sample, and between two runs the function returns
    no input. The function returns no input within a jump of the log between two rest positions either, because the
    position during the jump is unknown.

    Parameters
    ----------
    drive : DriveHistory
        Drive history whose times increase over the whole table.
    time_s : float
        Time on the drive's clock.

    Returns
    -------
    DriveState or None
        None if the instant is not within a run, or is within a jump of the log.
    """
    after = int(np.searchsorted(drive.time_s, time_s, side="left"))
    if after == drive.time_s.size:
        return None
    if drive.time_s[after] == time_s:
        before = after
    elif after == 0:
        return None
    else:
        before = after - 1
    run = ("", "") if drive.run is None else (drive.run[before], drive.run[after])
    if run[0] != run[1]:
        return None
    if before != after and jumps(drive)[before]:
        return None
    start_s, end_s = float(drive.time_s[before]), float(drive.time_s[after])
    share = 0.0 if before == after else (time_s - start_s) / (end_s - start_s)
    force_n = None
    if drive.force_n is not None:
        force_n = float((1.0 - share) * drive.force_n[before] + share * drive.force_n[after])
    input_mm = float((1.0 - share) * drive.input_mm[before] + share * drive.input_mm[after])
    if before != after:
        chosen, curves = _curves(drive)
        if chosen[before] >= 0:
            input_mm = float(curves[chosen[before]](np.float64(time_s)))
    return DriveState(run[0], input_mm, force_n)

"""State of the drive (input, run, force) at the time of a frame, and the jumps of its log, in which it is unknown."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.motion.encoder import input_sigma

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
    """Interpolate the drive linearly between the two samples that bracket an instant.

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
    return DriveState(run[0], float((1.0 - share) * drive.input_mm[before] + share * drive.input_mm[after]), force_n)

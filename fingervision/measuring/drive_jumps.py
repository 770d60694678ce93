"""Intervals of a log in which the stage jumps between two rest positions, so that its position is unknown."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.stage_record.encoder import input_sigma

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

"""Intervals of a log in which the stage's position is unknown: jumps between rest positions, and reversals."""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.stage_record.encoder import input_sigma
from fingervision.stage_record.turning_points import turning_points

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


def unseen_turns(drive: DriveHistory) -> tuple[int, float]:
    """Number of turning points between two rows of the log, and their largest distance from the rows' line (mm)."""
    runs = [slice(0, drive.input_mm.size)]
    if drive.run is not None:
        ends = [0, *(1 + np.flatnonzero(np.array(drive.run[1:]) != np.array(drive.run[:-1]))), len(drive.run)]
        runs = [slice(begin, end) for begin, end in pairwise(ends)]
    sigma_mm, _ = input_sigma(drive.input_mm, tuple(runs), drive.time_s)
    points = turning_points(drive.input_mm, drive.time_s, tuple(runs), sigma_mm)
    lines_mm = np.interp([point.time_s for point in points], drive.time_s, drive.input_mm)
    beyond = [abs(point.input_mm - line_mm) for point, line_mm in zip(points, lines_mm, strict=True)]
    return len(points), float(max(beyond, default=0.0))

"""Reversals of the stage between two rows of a log, which the interpolated input cuts off."""

from itertools import pairwise

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.stage_record.corners import corners
from fingervision.stage_record.encoder import input_sigma


def unseen_turns(drive: DriveHistory) -> tuple[int, float]:
    """Number of turning points between two rows of the log, and their largest distance from the rows' line (mm)."""
    runs = [slice(0, drive.input_mm.size)]
    if drive.run is not None:
        ends = [0, *(1 + np.flatnonzero(np.array(drive.run[1:]) != np.array(drive.run[:-1]))), len(drive.run)]
        runs = [slice(begin, end) for begin, end in pairwise(ends)]
    sigma_mm, _ = input_sigma(drive.input_mm, tuple(runs), drive.time_s)
    found = corners(drive.input_mm, drive.time_s, tuple(runs), sigma_mm)
    points = [corner.points(corner.short_by[0])[0] for corner in found if corner.least_mm is not None]
    lines_mm = np.interp([at_s for at_s, _ in points], drive.time_s, drive.input_mm)
    beyond = [abs(at_mm - line_mm) for (_, at_mm), line_mm in zip(points, lines_mm, strict=True)]
    return len(points), float(max(beyond, default=0.0))

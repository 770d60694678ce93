"""Work after the last frame: find the drive's clock, write the summary, and explain frames without an input."""

from collections.abc import Set
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError
from fingervision.domain.status import Status
from fingervision.measuring.drive_clock import clock_of, refusal, sentence
from fingervision.measuring.drive_clock import in_words as clock_in_words
from fingervision.measuring.frame_loop import Prepared
from fingervision.measuring.series import GapSeries
from fingervision.measuring.summary import summarise
from fingervision.measuring.task import Task, in_words
from fingervision.measuring.words import COVERAGE_FACTOR
from fingervision.motion.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.motion.corners import corners
from fingervision.motion.drive_at import within_jump
from fingervision.motion.encoder import input_sigma

# Reversals of the stage between two rows of a log, which the interpolated input cuts off.


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


Clock = ClockOffset | NoClockOffset | None


def clock_for(series: GapSeries, task: Task) -> Clock:
    """Find the offset of the drive's clock from the motion; None without a drive, or if the offset was given."""
    return None if task.drive is None or task.drive_offset_s is not None else clock_of(series, task.drive)


def clock_drawn(clock: Clock, task: Task) -> ClockOffset | float | None:
    """Clock offset with which the plot shows the drive: found, given, or None."""
    return clock if isinstance(clock, ClockOffset) else task.drive_offset_s


def summary_of(how: Prepared, task: Task, series: GapSeries, clock: Clock, *, complete: bool) -> dict[str, Any]:
    """Compose summary.json of a recording; `complete` states whether it was measured to its end."""
    description = how.description
    if isinstance(clock, ClockOffset):
        description = replace(description, notes=(*description.notes, sentence(clock), *clock.notes))
    description = replace(description, notes=(*description.notes, *_on_the_log(task, series, clock)))
    given_s = task.drive_offset_s if task.drive is not None else None
    settings = {**in_words(task, how.settings), **clock_in_words(clock, given_s)}
    return summarise(description, settings, task.scale, task.scale_file, series, complete=complete)


def _on_the_log(task: Task, series: GapSeries, clock: Clock) -> list[str]:
    """Sentences on frames whose input the drive's log does not show, or shows too small."""
    notes = []
    unknown = _within_jumps(task, series, clock)
    if unknown:
        notes.append(
            f"{unknown} frames lie within jumps of the drive's log, so that the position of the stage is unknown; the "
            "input of these frames is empty."
        )
    if task.drive_rests:
        notes.append(
            f"The drive's log has rows only where the position changes: in {task.drive_rests} rest"
            f"{'s' * (task.drive_rests > 1)}, the stage is taken to stand until shortly before the next row."
        )
    if task.drive is None or not series.gap_mm.size:
        return notes
    turned, missed_mm = unseen_turns(task.drive)
    gap_per_input = float(np.ptp(series.gap_mm)) / max(float(np.ptp(task.drive.input_mm)), 1e-12)
    # The error of the input is of interest once it moves the gap visibly.
    if turned and gap_per_input * missed_mm > COVERAGE_FACTOR * float(np.median(series.u_random_mm)):
        notes.append(
            f"The stage turned between two rows of the drive's log ({turned} time{'s' * (turned > 1)}), up to "
            f"{1e3 * missed_mm:.2g} um beyond the line between them; the input of the frames is interpolated linearly "
            "and is too small there. Log the drive several times as fast as the camera."
        )
    return notes


def _within_jumps(task: Task, series: GapSeries, clock: Clock) -> int:
    """Count the frames that lie within a jump of the drive's log."""
    times = series.times_s()
    if task.drive is None or times is None:
        return 0
    if isinstance(clock, ClockOffset):
        log_s = np.array([clock.log_time_s(float(time_s)) for time_s in times[0]])
    elif task.drive_offset_s is not None:
        log_s = times[0] - task.drive_offset_s
    else:
        return 0
    return int(np.count_nonzero(within_jump(task.drive, log_s)))


def undriven(task: Task, series: GapSeries, clock: Clock, driven: Set[bool], where: str) -> DataError | None:
    """Error that explains why no frame has an input; None if a frame has one, or if there is no drive.

    Parameters
    ----------
    task : Task
        Settings of the measurement, with the drive.
    series : GapSeries
        The gap over time.
    clock : ClockOffset, NoClockOffset or None
        Result of `clock_for`.
    driven : set of bool
        Whether rows received an input, if the offset was given.
    where : str
        Place of the table of gaps, for the sentence.

    Returns
    -------
    DataError or None
        Error for an offset that was not found, or for a given offset that leaves no frame within the drive's times.
    """
    if isinstance(clock, NoClockOffset) and series.counts[Status.OK]:
        return refusal(clock, where)
    if task.drive is not None and task.drive_offset_s is not None and driven == {False}:
        return DataError(
            f"No frame lies within the drive's times ({task.drive.time_s[0]:g} to {task.drive.time_s[-1]:g} s, shifted "
            f"by {task.drive_offset_s:g} s), so no row has an input; the gaps are {where}. Give another "
            "--drive-offset-s, or leave this option out, so that the offset is found from the motion."
        )
    return None

"""Work after the last frame: find the drive's clock, write the summary, and explain frames without an input."""

from collections.abc import Set
from dataclasses import replace
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
from fingervision.measuring.task import IF_SEEN, NO_FINGERS, Task, in_words
from fingervision.motion.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.motion.drive_at import within_jump

Clock = ClockOffset | NoClockOffset | None


def clock_for(series: GapSeries, task: Task) -> Clock:
    """Find the offset of the drive's clock from the motion; None without a drive, or if the offset was given."""
    return None if task.drive is None or task.drive_offset_s is not None else clock_of(series, task.drive)


def clock_drawn(clock: Clock, task: Task) -> ClockOffset | float | None:
    """Clock offset with which the plot shows the drive: found, given, or None."""
    return clock if isinstance(clock, ClockOffset) else task.drive_offset_s


def log_on_the_recording(clock: Clock, task: Task) -> DriveHistory | None:
    """The drive's log on the recording's clock; None without a drive, or without an offset."""
    if task.drive is None:
        return None
    if isinstance(clock, ClockOffset):
        return clock.on_the_recording(task.drive)
    given_s = task.drive_offset_s
    return None if given_s is None else replace(task.drive, time_s=task.drive.time_s + given_s)


def summary_of(how: Prepared, task: Task, series: GapSeries, clock: Clock, *, complete: bool) -> dict[str, Any]:
    """Compose summary.json of a recording; `complete` states whether it was measured to its end."""
    description = how.description
    if task.fingers == IF_SEEN:
        has_fingers = series.counts[Status.OK] > 0 and not series.is_chance
        task = replace(task, fingers="auto" if has_fingers else NO_FINGERS)
    if isinstance(clock, ClockOffset):
        description = replace(description, notes=(*description.notes, sentence(clock), *clock.notes))
    description = replace(description, notes=(*description.notes, *_on_the_log(task, series, clock)))
    given_s = task.drive_offset_s if task.drive is not None else None
    settings = {**in_words(task, how.settings), **clock_in_words(clock, given_s)}
    summary = summarise(description, settings, task.scale, task.scale_file, series, complete=complete)
    return summary if task.mechanism is None else {**summary, "mechanism": dict(task.mechanism)}


def _on_the_log(task: Task, series: GapSeries, clock: Clock) -> list[str]:
    """Sentences on frames whose input the drive's log does not show."""
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

"""Steps after the last frame: find the drive's clock, write the summary, and explain frames without input."""

from collections.abc import Set
from dataclasses import replace
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.status import Status
from fingervision.measuring.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.measuring.clock.common_clock import clock_of, refusal, sentence
from fingervision.measuring.clock.common_clock import in_words as clock_in_words
from fingervision.measuring.frame_loop import Prepared
from fingervision.measuring.series import GapSeries
from fingervision.measuring.summary import summarise
from fingervision.measuring.task import Task, in_words

Clock = ClockOffset | NoClockOffset | None


def clock_for(series: GapSeries, task: Task) -> Clock:
    """Find the drive's clock from the motion; None where there is no drive, or its offset was given."""
    return None if task.drive is None or task.drive_offset_s is not None else clock_of(series, task.drive)


def clock_drawn(clock: Clock, task: Task) -> ClockOffset | float | None:
    """The clock with which the figure draws the drive: found, given, or none."""
    return clock if isinstance(clock, ClockOffset) else task.drive_offset_s


def summary_of(how: Prepared, task: Task, series: GapSeries, clock: Clock, *, complete: bool) -> dict[str, Any]:
    """Compose summary.json of a recording; `complete` tells whether it was measured to its end."""
    description = how.description
    if isinstance(clock, ClockOffset):
        description = replace(description, notes=(*description.notes, sentence(clock), *clock.notes))
    given_s = task.drive_offset_s if task.drive is not None else None
    settings = {**in_words(task, how.settings), **clock_in_words(clock, given_s)}
    return summarise(description, settings, task.scale, task.scale_file, series, complete=complete)


def undriven(task: Task, series: GapSeries, clock: Clock, driven: Set[bool], where: str) -> DataError | None:
    """Sentence why the drive gave no frame an input; None where it gave some, or there is no drive.

    Parameters
    ----------
    task : Task
        With the drive.
    series : GapSeries
        The gap over time.
    clock : ClockOffset, NoClockOffset or None
        As `clock_for` gives it.
    driven : set of bool
        Whether rows got an input, as far as the offset was given.
    where : str
        Where the gaps are, for the sentence.

    Returns
    -------
    DataError or None
        The offset was not found, or the one that was given leaves no frame within the drive's times.
    """
    if isinstance(clock, NoClockOffset) and series.counts[Status.OK]:
        return refusal(clock, where)
    if task.drive is not None and task.drive_offset_s is not None and driven == {False}:
        return DataError(
            f"No frame lies within the drive's times ({task.drive.time_s[0]:g} to {task.drive.time_s[-1]:g} s, shifted "
            f"by {task.drive_offset_s:g} s), so no row has an input; the gaps are {where}. Give another "
            "--drive-offset-s, or leave it out to have it found from the motion."
        )
    return None

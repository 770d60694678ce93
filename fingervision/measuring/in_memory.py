"""Measure a recording in memory: every row and result is kept, and no file is written."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import FrameSource
from fingervision.gauges.recording import GaugeRecording, Tally
from fingervision.measuring.frame_loop import Prepared, Progress, measure_frames, prepared
from fingervision.measuring.outcome import Clock, clock_for, summary_of, undriven
from fingervision.measuring.rows import Result
from fingervision.measuring.series import GapSeries
from fingervision.measuring.task import Task, task_for_frames
from fingervision.motion.clock.clock_offset import ClockOffset
from fingervision.motion.drive_at import drive_at
from fingervision.storage.gaps_csv import TIME_PLACES, GapRow
from fingervision.storage.gauge_files import GaugeRow, GaugeRows


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredInMemory:
    """Result of a measurement in memory.

    Parameters
    ----------
    source : FrameSource
        The recording.
    task : Task
        Settings of the measurement.
    how : Prepared
        Information known before the measurement.
    rows : tuple of GapRow
        One row per frame.
    results : tuple of Result
        One result per frame, in pixels.
    series : GapSeries
        The gap over time.
    clock : ClockOffset, NoClockOffset or None
        Relation to the drive's clock, if the offset was to be found.
    summary : dict
        Content of summary.json.
    first_frame : Frame or None
        The first picture that could be read.
    stopped : bool
        Whether the user stopped the measurement before the end of the recording.
    refusal : DataError or None
        Reason why the drive gave no frame an input; None if it did, or there is no drive.
    gauge_rows : tuple of GaugeRow
        Results of the gauges, as in gauges.csv.
    tallies : mapping of str to Tally
        Each gauge over time, by its name.
    """

    source: FrameSource
    task: Task
    how: Prepared
    rows: tuple[GapRow, ...] = field(repr=False)
    results: tuple[Result, ...] = field(repr=False)
    series: GapSeries = field(repr=False)
    clock: Clock
    summary: dict[str, Any] = field(repr=False)
    first_frame: Frame | None = field(repr=False)
    stopped: bool = False
    refusal: DataError | None = None
    gauge_rows: tuple[GaugeRow, ...] = field(default=(), repr=False)
    tallies: Mapping[str, Tally] = field(default_factory=dict, repr=False)


def measure_in_memory(source: FrameSource, task: Task, on_progress: Progress | None = None) -> MeasuredInMemory:
    """Measure a recording from its first frame to its last, without writing files.

    Parameters
    ----------
    source : FrameSource
        The recording; it must have an end.
    task : Task
        Settings of the measurement.
    on_progress : callable or None
        Called at intervals with the number of frames done and the number that the source announces.

    Raises
    ------
    UsageError
        The region lies outside the frame.
    DataError, InputFileError, OutputError
        The scale is for other frames, or a gauge lies outside of them.
    """
    task = task_for_frames(task, source.description)
    how = prepared(source.description, task)
    series = GapSeries()
    rows: list[GapRow] = []
    results: list[Result] = []
    first: list[Frame] = []
    description = how.description
    gauge_rows = GaugeRows()
    gauges = (
        GaugeRecording(task.gauges, task.scale, (description.width_px, description.height_px), how.settings, gauge_rows)
        if task.gauges
        else None
    )

    def take_rows(these: Sequence[Result], of_these: Sequence[GapRow]) -> None:
        results.extend(these)
        rows.extend(of_these)

    def see_item(item: Frame | LostFrame, result: Result) -> None:
        if gauges is not None:
            gauges.add(item, result.outcome, series.camera)
        if not first and isinstance(item, Frame):
            # The pixels are copied, because the decoder may use its memory again for the next picture.
            first.append(replace(item, pixels=item.pixels.copy()))

    with ExitStack() as stack:
        if gauges is not None:
            stack.enter_context(gauges)
        stopped = measure_frames(source, how, series, take_rows, see_item, on_progress)
    how = how.with_camera(series.camera)
    clock = clock_for(series, task)
    if isinstance(clock, ClockOffset):
        rows = [_with_drive(row, task, clock) for row in rows]
    refusal = None if stopped else undriven(task, series, clock, {row.input_mm is not None for row in rows}, "measured")
    summary = summary_of(how, task, series, clock, complete=not stopped)
    if gauges is not None:
        summary["gauges"] = gauges.in_words()
    return MeasuredInMemory(
        source,
        task,
        how,
        tuple(rows),
        tuple(results),
        series,
        clock,
        summary,
        first[0] if first else None,
        stopped,
        refusal,
        tuple(gauge_rows),
        {} if gauges is None else gauges.tallies,
    )


def _with_drive(row: GapRow, task: Task, clock: ClockOffset) -> GapRow:
    """Add the drive's state at a frame's time to the frame's row, rounded as in gaps.csv."""
    if row.time_s is None or task.drive is None:
        return row
    found = drive_at(task.drive, clock.log_time_s(round(row.time_s, TIME_PLACES)))
    if found is None:
        return row
    return replace(row, run=found.run, input_mm=found.input_mm, force_n=found.force_n)


__all__ = ["MeasuredInMemory", "measure_in_memory"]

"""Measure a recording: write the gap over time, a summary and a plot."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fingervision.domain.errors import ExitCode, UsageError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.source import FrameSource
from fingervision.gauges.recording import GaugeRecording
from fingervision.measuring.drive_clock import join_drive
from fingervision.measuring.frame_loop import Progress, measure_frames, prepared
from fingervision.measuring.gap_figure import draw_gap
from fingervision.measuring.gauge_figure import draw_gauges
from fingervision.measuring.outcome import clock_drawn, clock_for, log_on_the_recording, summary_of, undriven
from fingervision.measuring.output_folder import OutputFolder, claimed, held
from fingervision.measuring.overlay_video import OverlayVideo
from fingervision.measuring.rows import Result
from fingervision.measuring.series import GapSeries
from fingervision.measuring.step_pictures import write_steps
from fingervision.measuring.task import NO_FINGERS, Task, task_for_frames
from fingervision.motion.clock.clock_offset import ClockOffset
from fingervision.storage.drive_csv import write_drive_log
from fingervision.storage.gaps_csv import GapRow, GapsCsv
from fingervision.storage.summary_json import write_summary


@dataclass(frozen=True, slots=True)
class Measured:
    """Result of a measurement that was written to files.

    Parameters
    ----------
    folder : OutputFolder
        Folder with the written files.
    series : GapSeries
        The gap over time.
    summary : dict
        Content of summary.json.
    stopped : bool
        Whether the user stopped the measurement before the end of the recording.
    has_gauge_numbers : bool
        Whether any gauge gave a value.
    """

    folder: OutputFolder
    series: GapSeries
    summary: dict[str, Any] = field(repr=False)
    stopped: bool
    has_gauge_numbers: bool = False

    @property
    def exit_code(self) -> ExitCode:
        """Exit code of the measurement."""
        has_gaps = self.series.counts[Status.OK] and not self.series.is_chance
        if self.stopped or not (has_gaps or self.has_gauge_numbers):
            return ExitCode.COULD_NOT
        return ExitCode.DAMAGED_INPUT if self.series.counts[Status.DAMAGED] else ExitCode.DONE


def measure(source: FrameSource, task: Task, out: Path, on_progress: Progress | None = None) -> Measured:
    """Measure a recording from its first frame to its last.

    Parameters
    ----------
    source : FrameSource
        The recording; read once, by a thread of its own.
    task : Task
        Settings of the measurement.
    out : Path
        Folder for the results; see `claimed`.
    on_progress : callable, optional
        Called at intervals with the number of frames done and the number that the source announces.

    Returns
    -------
    Measured
        The result; if the user stopped the measurement, everything measured until then is in the files.

    Raises
    ------
    UsageError
        The region lies outside the frame, or a frame is asked for that there is not.
    OutputError
        The results cannot be written, or the scale is for other frames. The rows until then are in gaps.csv.
    """
    refuse_camera(source)
    task = task_for_frames(task, source.description)
    with held(out):
        return _measured(source, task, out, on_progress)


def _measured(source: FrameSource, task: Task, out: Path, on_progress: Progress | None) -> Measured:
    how = prepared(source.description, task)
    folder = claimed(out, source.description.files)
    series = GapSeries()
    driven: set[bool] = set()
    with ExitStack() as stack:
        table = stack.enter_context(GapsCsv(folder.gaps, task.drive_columns))
        video = stack.enter_context(OverlayVideo(folder.overlay, how.description)) if task.overlay else None
        gauges = (
            stack.enter_context(
                GaugeRecording(
                    task.gauges,
                    task.scale,
                    (how.description.width_px, how.description.height_px),
                    how.settings,
                    folder.gauges,
                )
            )
            if task.gauges
            else None
        )

        def take_rows(_: Sequence[Result], rows: Sequence[GapRow]) -> None:
            driven.update(row.input_mm is not None for row in rows)
            table.add(rows)

        def see_item(item: Frame | LostFrame, result: Result) -> None:
            if gauges is not None:
                gauges.add(item, result.outcome, series.camera)
            if video is not None and isinstance(item, Frame):
                row = how.row_maker.rows([result])[0]
                video.add(item, result.outcome, row, None if gauges is None else gauges.draw)
            if isinstance(item, Frame) and item.index == task.steps_frame:
                write_steps(
                    item,
                    replace(how.settings, camera=series.camera),
                    folder.steps,
                    () if gauges is None else gauges.steps(item),
                )

        is_seen = video is not None or gauges is not None or task.steps_frame is not None
        stopped = measure_frames(source, how, series, take_rows, see_item if is_seen else None, on_progress)
    how = how.with_camera(series.camera)
    clock = clock_for(series, task)
    if isinstance(clock, ClockOffset) and task.drive is not None:
        join_drive(folder.gaps, task.drive, clock)
    if (log := log_on_the_recording(clock, task)) is not None:
        write_drive_log(folder.drive_log, log)
    summary = summary_of(how, task, series, clock, complete=not stopped)
    if summary["settings"]["fingers"] != NO_FINGERS:
        draw_gap(folder.figure, series, task.drive, clock_drawn(clock, task))
    if gauges is not None:
        summary["gauges"] = gauges.in_words()
        draw_gauges(folder.gauge_figure, gauges.tallies)
    write_summary(folder.summary, summary)
    if not stopped and (refusal := undriven(task, series, clock, driven, f"in {folder.gaps}")) is not None:
        raise refusal
    if task.steps_frame is not None and not folder.steps.exists() and not stopped:
        raise UsageError(
            f"--steps must be the number of a frame that can be read, 0 to {series.frames - 1}, "
            f"but is {task.steps_frame}; the gaps are in {folder.gaps}."
        )
    return Measured(folder, series, summary, stopped, gauges is not None and gauges.has_numbers)


def refuse_camera(source: FrameSource) -> None:
    """Refuse a source that has no end, such as a camera.

    Raises
    ------
    UsageError
        If the source is a camera or a stream.
    """
    if hasattr(source, "received"):
        raise UsageError(
            f"`fingervision measure` needs a recording, which has an end, but {source.description.name} is a "
            "camera, which does not: record "
            f"it with `fingervision live {source.description.name} --no-page --out runs`."
        )

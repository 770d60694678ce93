"""Write a recording measured in memory to the same files as the command writes."""

from pathlib import Path

from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Frame
from fingervision.frames.frame_range import frame_range
from fingervision.frames.source import FrameSource
from fingervision.gauges.recording import GaugeRecording
from fingervision.measuring.gap_figure import draw_gap
from fingervision.measuring.in_memory import MeasuredInMemory
from fingervision.measuring.marked import marked
from fingervision.measuring.outcome import clock_drawn
from fingervision.measuring.output_folder import OutputFolder, claimed, held
from fingervision.measuring.overlay_video import OverlayVideo
from fingervision.measuring.step_pictures import write_steps
from fingervision.storage.gaps_csv import GapsCsv
from fingervision.storage.gauges_csv import GaugeRows, GaugesCsv
from fingervision.storage.lost_frames import lost_frames
from fingervision.storage.summary_json import refuse_other_recording, write_summary


def save_measured(
    found: MeasuredInMemory, again: FrameSource, out: Path, *, overlay: bool = False, steps_frame: int | None = None
) -> OutputFolder:
    """Write gaps.csv, summary.json, gap.png and, if requested, overlay.mp4 and steps/.

    Parameters
    ----------
    found : MeasuredInMemory
        The measured recording.
    again : FrameSource
        The same recording, from which pictures are read again if needed.
    out : Path
        Folder for the results.
    overlay : bool
        Whether to write overlay.mp4.
    steps_frame : int or None
        Number of the frame of which every step is written as a picture.

    Raises
    ------
    UsageError
        The folder holds the results of another recording, or there is no such frame.
    OutputError
        The folder cannot be written, or holds files that no measurement wrote.
    """
    description, task, series = found.source.description, found.task, found.series
    first, last = (found.rows[0].frame, found.rows[-1].frame) if found.rows else (0, -1)
    if steps_frame is not None and not first <= steps_frame <= last:
        raise UsageError(
            f"--steps (pictures of the processing steps) must be the number of a frame, {first} to {last}, but "
            f"is {steps_frame}."
        )
    refuse_other_recording(out, description.name)
    with held(out):
        folder = claimed(out, description.files)
        with GapsCsv(folder.gaps, task.drive_columns) as table:
            table.add(found.rows)
        if task.gauges:
            with GaugesCsv(folder.gauges) as numbers:
                numbers.add(found.gauge_rows)
        if overlay:
            _draw_overlay(found, again, folder.overlay)
        if steps_frame is not None:
            wanted = next((item for item in again if item.index == steps_frame), None)
            if not isinstance(wanted, Frame):
                raise UsageError(
                    f"--steps must be the number of a frame that can be read, but frame {steps_frame} cannot."
                )
            write_steps(wanted, found.how.settings, folder.steps)
        draw_gap(folder.figure, series, task.drive, clock_drawn(found.clock, task))
        write_summary(folder.summary, found.summary)
    return folder


def _draw_overlay(found: MeasuredInMemory, again: FrameSource, path: Path) -> None:
    """Draw the overlay video; gauges are measured again, because they track features from frame to frame."""
    description, task = found.how.description, found.task
    marks = lost_frames(found.source.description.files)
    frames = marked(again, marks) if marks else again
    if task.frames is not None:
        frames = frame_range(frames, *task.frames)
    size_px = (description.width_px, description.height_px)
    gauges = GaugeRecording(task.gauges, task.scale, size_px, found.how.settings, GaugeRows()) if task.gauges else None
    with OverlayVideo(path, description) as video:
        for item, result, row in zip(frames, found.results, found.rows, strict=False):
            if gauges is not None:
                gauges.add(item, result.outcome)
            if isinstance(item, Frame):
                video.add(item, result.outcome, row, None if gauges is None else gauges.draw)


__all__ = ["save_measured"]

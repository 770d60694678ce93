"""The folder for results: it is created if needed, and files of other programs in it are never overwritten."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import OutputError, UsageError
from fingervision.domain.frame import Frame
from fingervision.frames.frame_range import frame_range
from fingervision.frames.source import FrameSource
from fingervision.gauges.recording import GaugeRecording
from fingervision.measuring.gap_figure import draw_gap
from fingervision.measuring.gauge_figure import draw_gauges
from fingervision.measuring.in_memory import MeasuredInMemory
from fingervision.measuring.marked import marked
from fingervision.measuring.outcome import clock_drawn, log_on_the_recording
from fingervision.measuring.overlay_video import OverlayVideo
from fingervision.measuring.step_pictures import write_steps
from fingervision.measuring.task import NO_FINGERS
from fingervision.storage.drive_csv import DRIVE_LOG, write_drive_log
from fingervision.storage.gaps_csv import COLUMNS, GapsCsv
from fingervision.storage.gauge_files import GaugeRows, GaugesCsv
from fingervision.storage.out_folder import FolderLock, make_out_folder, out_folder
from fingervision.storage.run_files import lost_frames
from fingervision.storage.summary_json import recording_of, refuse_other_recording, write_summary

GAPS, SUMMARY, FIGURE, OVERLAY, STEPS = "gaps.csv", "summary.json", "gap.png", "overlay.mp4", "steps"
GAUGES, GAUGE_FIGURE = "gauges.csv", "gauges.png"


@dataclass(frozen=True, slots=True)
class OutputFolder:
    """Paths of the files that one measurement writes."""

    path: Path

    @property
    def gaps(self) -> Path:
        """Path of the table of gaps, gaps.csv."""
        return self.path / GAPS

    @property
    def gauges(self) -> Path:
        """Path of the table of the gauges."""
        return self.path / GAUGES

    @property
    def gauge_figure(self) -> Path:
        """Path of the figure of the gauges over time."""
        return self.path / GAUGE_FIGURE

    @property
    def drive_log(self) -> Path:
        """Path of the drive's log on the recording's clock."""
        return self.path / DRIVE_LOG

    @property
    def summary(self) -> Path:
        """Path of summary.json."""
        return self.path / SUMMARY

    @property
    def figure(self) -> Path:
        """Path of the figure of the gap over time."""
        return self.path / FIGURE

    @property
    def overlay(self) -> Path:
        """Path of the overlay video."""
        return self.path / OVERLAY

    @property
    def steps(self) -> Path:
        """Folder of the pictures of every step."""
        return self.path / STEPS


def claimed(path: Path, recording_files: tuple[Path, ...]) -> OutputFolder:
    """Create the folder for results, or take over that of an earlier measurement and remove its files.

    Parameters
    ----------
    path : Path
        The folder.
    recording_files : tuple of Path
        Files of the recording; none of them may be overwritten, and results may not lie among a recording's images.

    Raises
    ------
    OutputError
        The folder cannot be made or written, or holds files of these names that no measurement wrote.
    UsageError
        The folder is where the recording's images are, or the recording would be replaced.
    """
    names = (GAPS, GAUGES, GAUGE_FIGURE, DRIVE_LOG, SUMMARY, FIGURE, OVERLAY, STEPS)
    for file in recording_files:
        same = file.resolve().parent == path.resolve()
        if same and (len(recording_files) > 1 or file.name in names):
            raise UsageError(f"--out must not be the folder of the recording, but {path} is: name another folder.")
    with out_folder(path):
        present = [name for name in names if (path / name).exists()]
        if present and not _is_ours(path / GAPS):
            raise OutputError(
                f"{path} already contains {present[0]}, which was not written by an earlier measurement of "
                "fingervision: name another folder with --out."
            )
        for name in present:
            if name == STEPS:
                shutil.rmtree(path / name)
            else:
                (path / name).unlink()
        trial = path / ".fingervision.part"
        trial.touch()
        trial.unlink()
    return OutputFolder(path)


def _is_ours(table: Path) -> bool:
    """Whether a table starts with the header that only this program writes."""
    if not table.is_file():
        return False
    with table.open("rb") as file:
        return file.read(len(COLUMNS)) == COLUMNS.encode()


@contextmanager
def held(out: Path) -> Iterator[None]:
    """Lock the folder while a measurement runs, because two measurements would overwrite each other's files."""
    make_out_folder(out)
    lock = FolderLock(out)
    try:
        yield
    finally:
        lock.remove()


def usual_folder(recording: str) -> Path:
    """Return measured/NAME, with NAME from the file or folder (for a glob, its folder), made unique by its path."""
    path = Path(recording)
    named = path.resolve() if path.exists() else path.parent.resolve()
    parts = [part for part in named.parts if part != named.anchor] or ["images"]
    for depth in range(1, len(parts) + 1):
        out = Path("measured") / "__".join(parts[-depth:])
        of = recording_of(out)
        if of is None or Path(of).resolve() == path.resolve():
            return out
    return out


# Write a recording measured in memory to the same files as the command writes.


def save_measured(
    found: MeasuredInMemory, again: FrameSource, out: Path, *, overlay: bool = False, steps_frame: int | None = None
) -> OutputFolder:
    """Write gaps.csv, summary.json, the figures and, if requested, overlay.mp4 and steps/.

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
            draw_gauges(folder.gauge_figure, found.tallies)
        if overlay:
            _draw_overlay(found, again, folder.overlay)
        if steps_frame is not None:
            wanted = next((item for item in again if item.index == steps_frame), None)
            if not isinstance(wanted, Frame):
                raise UsageError(
                    f"--steps must be the number of a frame that can be read, but frame {steps_frame} cannot."
                )
            write_steps(wanted, found.how.settings, folder.steps)
        if (log := log_on_the_recording(found.clock, task)) is not None:
            write_drive_log(folder.drive_log, log)
        if found.summary["settings"]["fingers"] != NO_FINGERS:
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

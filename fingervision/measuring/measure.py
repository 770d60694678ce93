"""A recording goes in; the gap over time, its summary and its figure come out."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic
from typing import Any

from calib.camera_response import CameraResponse
from fingervision.domain.direction import Direction
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ExitCode, FingervisionError, UsageError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.region import Region
from fingervision.domain.status import Status
from fingervision.frames.ahead import decoded_ahead
from fingervision.frames.source import Description, FrameSource
from fingervision.measuring.asked_to_stop import asked_to_stop
from fingervision.measuring.gap_figure import draw_gap
from fingervision.measuring.marked import marked
from fingervision.measuring.one_polarity import one_polarity
from fingervision.measuring.other_camera import other_camera
from fingervision.measuring.output_folder import OutputFolder, claimed
from fingervision.measuring.overlay_video import OverlayVideo
from fingervision.measuring.response_budget import choose_response
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.scale import Scale
from fingervision.measuring.series import GapSeries
from fingervision.measuring.step_pictures import write_steps
from fingervision.measuring.summary import summarise
from fingervision.storage.folder_lock import FolderLock
from fingervision.storage.gaps_csv import GapsCsv
from fingervision.storage.lost_frames import lost_frames
from fingervision.storage.out_folder import make_out_folder
from fingervision.storage.recorded_camera import recorded_camera
from fingervision.storage.summary_json import write_summary
from fingervision.vision.pipeline import Settings

# Rows are made for so many frames at once, or for what has come in so many seconds, and then handed to the table.
FRAMES_AT_ONCE, SECONDS_AT_ONCE = 128, 0.4


@dataclass(frozen=True, slots=True)
class Task:
    """What shall be measured, and how.

    Parameters
    ----------
    scale : Scale
        From pixels to millimetres.
    scale_file : Path or None
        The calibration that the scale was read from.
    below_tip_mm : float
        Height of measuring below each finger's tip.
    direction : Direction or None
        Where the tips point; None finds out in every frame.
    region : Region or None
        The part of the frame that is looked at.
    drive : DriveHistory or None
        The recorded input.
    drive_offset_s : float
        Added to the drive's times to get the recording's.
    overlay : bool
        Whether a video is written with what was measured drawn in.
    steps_frame : int or None
        The frame of which every step is written as a picture.
    response : CameraResponse or None
        The camera's response, where the user knows it.
    bits : int or None
        Depth of levels that are stored in 16 bits; None finds it in every frame.
    fingers_are_dark : bool or None
        Whether the fingers are darker than the ground; None finds out in every frame.
    """

    scale: Scale
    scale_file: Path | None = None
    below_tip_mm: float = 0.3
    direction: Direction | None = None
    region: Region | None = None
    drive: DriveHistory | None = None
    drive_offset_s: float = 0.0
    overlay: bool = False
    steps_frame: int | None = None
    response: CameraResponse | None = None
    bits: int | None = None
    fingers_are_dark: bool | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.below_tip_mm < float("inf"):
            raise UsageError(f"--below-tip-mm must be positive, but is {self.below_tip_mm:g}.")
        if not -float("inf") < self.drive_offset_s < float("inf"):
            raise UsageError(f"--drive-offset-s must be a number of seconds, but is {self.drive_offset_s:g}.")
        if self.steps_frame is not None and self.steps_frame < 0:
            raise UsageError(f"--steps must be the number of a frame, from 0, but is {self.steps_frame}.")

    @property
    def settings(self) -> Settings:
        """What vision needs of it, whatever the recording says of itself."""
        return self.settings_for(())[0]

    def settings_for(self, files: tuple[Path, ...]) -> tuple[Settings, str]:
        """What vision needs of it for a recording of these files, and a warning where there is one."""
        response, other, words = choose_response(self.response, self.scale, files)
        below_px = self.below_tip_mm * self.scale.px_per_mm
        settings = Settings(below_px, self.direction, self.region, response, other, self.bits, self.fingers_are_dark)
        return settings, words

    @property
    def drive_columns(self) -> tuple[str, ...]:
        """Columns that the drive adds to the table."""
        if self.drive is None:
            return ()
        return ("run", "input_mm") if self.drive.force_n is None else ("run", "input_mm", "force_n")


@dataclass(frozen=True, slots=True)
class Measured:
    """What a measurement left behind.

    Parameters
    ----------
    folder : OutputFolder
        The files.
    series : GapSeries
        The gap over time.
    summary : dict
        As in summary.json.
    stopped : bool
        Whether the user stopped it before the recording's end.
    """

    folder: OutputFolder
    series: GapSeries
    summary: dict[str, Any] = field(repr=False)
    stopped: bool

    @property
    def exit_code(self) -> ExitCode:
        """How the measurement ended."""
        if self.stopped or not self.series.counts[Status.OK]:
            return ExitCode.COULD_NOT
        return ExitCode.DAMAGED_INPUT if self.series.counts[Status.DAMAGED] else ExitCode.DONE


Progress = Callable[[int, int | None], None]


def measure(source: FrameSource, task: Task, out: Path, on_progress: Progress | None = None) -> Measured:
    """Measure a recording from its first frame to its last.

    Parameters
    ----------
    source : FrameSource
        The recording; read once, by a thread of its own.
    task : Task
        What shall be measured.
    out : Path
        Folder for the results; see `claimed`.
    on_progress : callable, optional
        Called now and then with the frames done and the frames that the source announces.

    Returns
    -------
    Measured
        Also where the user stopped it: everything until then is in the files.

    Raises
    ------
    UsageError
        The region lies outside the frame, or a frame is asked for that there is not.
    FingervisionError
        The results cannot be written, or the scale is for other frames. The rows until then are in gaps.csv.
    """
    if hasattr(source, "received"):
        raise UsageError(
            f"measure needs a recording, which ends, but {source.description.name} is a camera, which does not: record "
            f"it with `fingervision live {source.description.name} --no-page --out runs`."
        )
    _check(task, source.description)
    with _held(out):
        return _measured(source, task, out, on_progress)


def _measured(source: FrameSource, task: Task, out: Path, on_progress: Progress | None) -> Measured:
    description = source.description
    if words := other_camera(task.scale, recorded_camera(description.files)):
        description = replace(description, notes=(words, *description.notes))
    settings, words = task.settings_for(description.files)
    if words:
        description = replace(description, notes=(words, *description.notes))
    folder = claimed(out, description.files)
    frame_size_px = (description.width_px, description.height_px)
    marks = lost_frames(description.files)
    row_maker = RowMaker(task.scale, frame_size_px, task.drive, task.drive_offset_s)
    series = GapSeries()
    stopped = False
    with ExitStack() as stack:
        asked = stack.enter_context(asked_to_stop())
        table = stack.enter_context(GapsCsv(folder.gaps, task.drive_columns))
        video = stack.enter_context(OverlayVideo(folder.overlay, description)) if task.overlay else None
        pending: list[Result] = []
        driven: set[bool] = set()

        def hand_over() -> None:
            results = pending.copy()
            pending.clear()
            rows = row_maker.rows(results)
            series.add(results, rows)
            driven.update(row.input_mm is not None for row in rows)
            table.add(rows)

        # Before the table is closed, whatever ends the loop.
        stack.callback(hand_over)
        handed_over_at = monotonic()
        try:
            for item, outcome in _outcomes(
                marked(source, marks) if marks else source, settings, series.votes, asked.is_set
            ):
                result = Result(item.index, item.time_s, outcome)
                pending.append(result)
                if video is not None and isinstance(item, Frame):
                    video.add(item, outcome, row_maker.rows([result])[0])
                if isinstance(item, Frame) and item.index == task.steps_frame:
                    write_steps(item, settings, folder.steps)
                if len(pending) >= FRAMES_AT_ONCE or monotonic() - handed_over_at >= SECONDS_AT_ONCE:
                    hand_over()
                    handed_over_at = monotonic()
                    if on_progress is not None:
                        on_progress(series.frames, description.frame_count)
            stopped = asked.is_set()
        except KeyboardInterrupt:
            stopped = True
    if on_progress is not None:
        on_progress(series.frames, description.frame_count)
    draw_gap(folder.figure, series)
    summary = summarise(
        description, _in_words(task, settings), task.scale, task.scale_file, series, complete=not stopped
    )
    write_summary(folder.summary, summary)
    if task.drive is not None and driven == {False} and not stopped:
        raise FingervisionError(
            f"No frame lies within the drive's times ({task.drive.time_s[0]:g} to {task.drive.time_s[-1]:g} s, shifted "
            f"by {task.drive_offset_s:g} s), so no row of {folder.gaps} has an input: give --drive-offset-s."
        )
    if task.steps_frame is not None and not folder.steps.exists() and not stopped:
        raise UsageError(
            f"--steps must be the number of a frame that can be read, 0 to {series.frames - 1}, "
            f"but is {task.steps_frame}; the gaps are in {folder.gaps}."
        )
    return Measured(folder, series, summary, stopped)


@contextmanager
def _held(out: Path) -> Iterator[None]:
    """Keep other measurements out of the folder meanwhile: each would replace what the other wrote."""
    make_out_folder(out)
    lock = FolderLock(out)
    try:
        yield
    finally:
        lock.remove()


def _outcomes(
    source: Iterable[Frame | LostFrame], settings: Settings, votes: Counter[str], is_stopped: Callable[[], bool]
) -> Iterator[tuple[Frame | LostFrame, GapMeasurement | NoGap | LostFrame]]:
    """Every frame with what it says; the decoder runs ahead and is stopped when this is."""
    with closing(decoded_ahead(source)) as frames:
        yield from one_polarity(frames, settings, votes, is_stopped)


def _check(task: Task, description: Description) -> None:
    """Refuse what cannot be meant for these frames."""
    width_px, height_px = description.width_px, description.height_px
    region = task.region
    if region is not None and not (
        region.x_px >= 0
        and region.y_px >= 0
        and region.width_px > 0
        and region.height_px > 0
        and region.x_px + region.width_px <= width_px
        and region.y_px + region.height_px <= height_px
    ):
        raise UsageError(
            f"--roi must lie inside the frame of {width_px}x{height_px} pixels, but is "
            f"{region.x_px},{region.y_px},{region.width_px},{region.height_px} (first column, row, width, height)."
        )
    if task.drive is not None and not description.has_times:
        raise UsageError(
            f"--drive needs a recording with times, but {description.name} has none: "
            "give --rate-hz, or a times.csv beside the images."
        )
    try:
        task.scale.check_frame_size(width_px, height_px)
    except ValueError as error:
        raise FingervisionError(str(error)) from error


def _in_words(task: Task, settings: Settings) -> dict[str, Any]:
    """Put the task as it stands in the summary."""
    region = task.region
    return {
        "below_tip_mm": task.below_tip_mm,
        "tips": "auto" if task.direction is None else task.direction.value,
        "roi": None if region is None else [region.x_px, region.y_px, region.width_px, region.height_px],
        "response": settings.response.name,
        "response_known": settings.other_response is None,
        "bits": task.bits,
        "fingers": {None: "auto", True: "dark", False: "light"}[task.fingers_are_dark],
        "drive": task.drive is not None,
        "drive_offset_s": task.drive_offset_s if task.drive is not None else None,
    }

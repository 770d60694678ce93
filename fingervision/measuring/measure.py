"""A recording goes in; the gap over time, its summary and its figure come out."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic
from typing import Any

from fingervision.domain.errors import ExitCode, FingervisionError, UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.frames.ahead import decoded_ahead
from fingervision.frames.camera_settings import coding_of
from fingervision.frames.frame_range import frame_range
from fingervision.frames.source import FrameSource
from fingervision.measuring.asked_to_stop import asked_to_stop
from fingervision.measuring.clock.alignment import ClockOffset, NoClockOffset
from fingervision.measuring.clock.common_clock import clock_of, join_drive, refusal, sentence
from fingervision.measuring.clock.common_clock import in_words as clock_in_words
from fingervision.measuring.gap_figure import draw_gap
from fingervision.measuring.marked import marked
from fingervision.measuring.one_polarity import one_polarity
from fingervision.measuring.other_camera import other_camera
from fingervision.measuring.output_folder import OutputFolder, claimed
from fingervision.measuring.overlay_video import OverlayVideo
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.series import GapSeries
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.measuring.step_pictures import write_steps
from fingervision.measuring.summary import summarise
from fingervision.measuring.task import Task, check_task, in_words
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
    check_task(task, source.description)
    with _held(out):
        return _measured(source, task, out, on_progress)


def _measured(source: FrameSource, task: Task, out: Path, on_progress: Progress | None) -> Measured:
    description = source.description
    if words := other_camera(task.scale, recorded_camera(description.files)):
        description = replace(description, notes=(words, *description.notes))
    # What is stored without loss may have come compressed from the camera.
    coding = coding_of(recorded_camera(description.files))
    if coding is not Coding.LOSSLESS and not description.lossy:
        description = replace(description, coding=coding)
    settings, words = task.settings_for(description.files)
    if words:
        description = replace(description, notes=(words, *description.notes))
    folder = claimed(out, description.files)
    frame_size_px = (description.width_px, description.height_px)
    marks = lost_frames(description.files)
    given_s = task.drive_offset_s
    row_maker = RowMaker(task.scale, frame_size_px, None if given_s is None else task.drive, given_s or 0.0)
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
                _asked_for(marked(source, marks) if marks else source, task),
                settings,
                description.coding,
                series.votes,
                asked.is_set,
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
    clock = None
    if task.drive is not None and given_s is None:
        clock = clock_of(series, task.drive)
        if isinstance(clock, ClockOffset):
            join_drive(folder.gaps, task.drive, clock)
            description = replace(description, notes=(*description.notes, sentence(clock), *clock.notes))
    draw_gap(folder.figure, series, task.drive, clock if isinstance(clock, ClockOffset) else given_s)
    words_of_task = {**in_words(task, settings), **clock_in_words(clock, given_s if task.drive is not None else None)}
    summary = summarise(description, words_of_task, task.scale, task.scale_file, series, complete=not stopped)
    write_summary(folder.summary, summary)
    if isinstance(clock, NoClockOffset) and not stopped and series.counts[Status.OK]:
        raise refusal(clock, folder.gaps)
    if task.drive is not None and given_s is not None and driven == {False} and not stopped:
        raise FingervisionError(
            f"No frame lies within the drive's times ({task.drive.time_s[0]:g} to {task.drive.time_s[-1]:g} s, shifted "
            f"by {given_s:g} s), so no row of {folder.gaps} has an input: give another --drive-offset-s, or leave it "
            "out to have it found from the motion."
        )
    if task.steps_frame is not None and not folder.steps.exists() and not stopped:
        raise UsageError(
            f"--steps must be the number of a frame that can be read, 0 to {series.frames - 1}, "
            f"but is {task.steps_frame}; the gaps are in {folder.gaps}."
        )
    return Measured(folder, series, summary, stopped)


def _asked_for(frames: Iterable[Frame | LostFrame], task: Task) -> Iterable[Frame | LostFrame]:
    return frames if task.frames is None else frame_range(frames, *task.frames)


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
    source: Iterable[Frame | LostFrame],
    settings: Settings,
    coding: Coding,
    votes: Counter[str],
    is_stopped: Callable[[], bool],
) -> Iterator[tuple[Frame | LostFrame, GapMeasurement | NoGap | LostFrame]]:
    """Every frame with what it says; the decoder runs ahead and is stopped when this is."""
    pictures = SoundPictures()
    with closing(decoded_ahead(source)) as frames:
        for item, outcome in one_polarity(_coded(frames, coding), settings, votes, is_stopped):
            if isinstance(item, LostFrame) or isinstance(outcome, LostFrame):
                yield item, outcome
            else:
                yield item, pictures.judged(item, outcome)


def _coded(frames: Iterable[Frame | LostFrame], coding: Coding) -> Iterator[Frame | LostFrame]:
    """Tell frames that are stored without loss what they came from."""
    for item in frames:
        if isinstance(item, Frame) and item.coding is Coding.LOSSLESS and coding is not Coding.LOSSLESS:
            yield replace(item, coding=coding)
        else:
            yield item

"""Measure every frame of a recording in order, and pass on the rows as soon as they are complete."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from time import monotonic

from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.frames.ahead import decoded_ahead
from fingervision.frames.camera_settings import coding_of
from fingervision.frames.frame_range import frame_range
from fingervision.frames.source import Description, FrameSource
from fingervision.measuring.asked_to_stop import asked_to_stop
from fingervision.measuring.frame_sequence import Judged, in_sequence
from fingervision.measuring.gap_budget import gap_budget
from fingervision.measuring.marked import marked
from fingervision.measuring.one_polarity import one_polarity
from fingervision.measuring.other_camera import other_camera
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.series import GapSeries
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.measuring.task import Task
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.lost_frames import lost_frames
from fingervision.storage.recorded_camera import recorded_camera
from fingervision.vision.pipeline import Settings

# Rows are computed and written for this number of frames at once, or for the frames of this time (s) if they are fewer.
FRAMES_AT_ONCE, SECONDS_AT_ONCE = 128, 0.4

Progress = Callable[[int, int | None], None]
TakeRows = Callable[[Sequence[Result], Sequence[GapRow]], None]
SeeItem = Callable[[Frame | LostFrame, Result], None]


@dataclass(frozen=True, slots=True)
class Prepared:
    """Description of a recording and settings of its measurement, each completed with values from the other.

    Parameters
    ----------
    description : Description
        Description of the recording, with notes that compare its camera with that of the scale.
    settings : Settings
        Settings for the image processing.
    row_maker : RowMaker
        Conversion of results from pixels to rows.
    frames : (int, int) or None
        First and last frame to be measured; None measures all.
    """

    description: Description
    settings: Settings
    row_maker: RowMaker
    frames: tuple[int, int] | None = None


def prepared(description: Description, task: Task) -> Prepared:
    """Collect the information on a recording that is known before its frames are read."""
    if words := other_camera(task.scale, recorded_camera(description.files)):
        description = replace(description, notes=(words, *description.notes))
    # A recording stored without loss may contain pictures that the camera had compressed.
    coding = coding_of(recorded_camera(description.files))
    if coding is not Coding.LOSSLESS and not description.lossy:
        description = replace(description, coding=coding)
    settings, words = task.settings_for(description.files)
    if words:
        description = replace(description, notes=(words, *description.notes))
    given_s = task.drive_offset_s
    frame_size_px = (description.width_px, description.height_px)
    row_maker = RowMaker(task.scale, frame_size_px, None if given_s is None else task.drive, given_s or 0.0)
    return Prepared(description, settings, row_maker, task.frames)


def measure_frames(
    source: FrameSource,
    how: Prepared,
    series: GapSeries,
    take_rows: TakeRows,
    see_item: SeeItem | None = None,
    on_progress: Progress | None = None,
) -> bool:
    """Measure a recording from its first frame to its last.

    Parameters
    ----------
    source : FrameSource
        Recording, read once, by a separate thread.
    how : Prepared
        Result of `prepared`.
    series : GapSeries
        Series to which every row is added.
    take_rows : callable
        Called with results and their rows, many frames at once, in order; also with those before an error.
    see_item : callable or None
        Called with every frame, also a lost one, and its result.
    on_progress : callable or None
        Called at intervals with the number of frames done and the number that the source announces.

    Returns
    -------
    bool
        Whether the user stopped the measurement before the recording's end; all rows up to then were passed on.
    """
    description = how.description
    marks = lost_frames(description.files)
    stopped = False
    items: Iterable[Frame | LostFrame] = marked(source, marks) if marks else source
    if how.frames is not None:
        items = frame_range(items, *how.frames)
    with ExitStack() as stack:
        asked = stack.enter_context(asked_to_stop())
        pending: list[Result] = []

        def hand_over() -> None:
            results = pending.copy()
            pending.clear()
            rows = how.row_maker.rows(results)
            series.add(results, rows)
            if measured := [result.outcome for result in results if isinstance(result.outcome, GapMeasurement)]:
                series.add_budget(gap_budget(measured, how.row_maker.scale))
            take_rows(results, rows)

        # The remaining rows are passed on however the loop ends.
        stack.callback(hand_over)
        handed_over_at = monotonic()
        try:
            for item, outcome in _outcomes(items, how.settings, description.coding, series.votes, asked.is_set):
                result = Result(item.index, item.time_s, outcome)
                pending.append(result)
                if see_item is not None:
                    see_item(item, result)
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
    return stopped


def _outcomes(
    source: Iterable[Frame | LostFrame],
    settings: Settings,
    coding: Coding,
    votes: Counter[str],
    is_stopped: Callable[[], bool],
) -> Iterator[tuple[Frame | LostFrame, GapMeasurement | NoGap | LostFrame]]:
    """Yield every frame with its result; the decoder runs ahead, and stops when this generator is closed."""
    pictures = SoundPictures()

    def judged(frames: Iterable[Frame | LostFrame]) -> Iterator[Judged]:
        for item, outcome in one_polarity(coded(frames, coding), settings, votes, is_stopped):
            if isinstance(item, LostFrame) or isinstance(outcome, LostFrame):
                yield item, outcome
            else:
                yield item, pictures.judged(item, outcome)

    with closing(decoded_ahead(source)) as frames:
        yield from in_sequence(judged(frames))


def coded(frames: Iterable[Frame | LostFrame], coding: Coding) -> Iterator[Frame | LostFrame]:
    """Attach to losslessly stored frames the information on how their pictures had been compressed before."""
    for item in frames:
        if isinstance(item, Frame) and item.coding is Coding.LOSSLESS and coding is not Coding.LOSSLESS:
            yield replace(item, coding=coding)
        else:
            yield item

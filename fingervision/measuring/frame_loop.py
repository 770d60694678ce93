"""Measure every frame of a recording in order, and pass on the rows as soon as they are complete."""

import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from time import monotonic
from types import FrameType

from fingervision.domain.camera import CameraModel
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.frames.ahead import decoded_ahead
from fingervision.frames.camera_settings import coding_of
from fingervision.frames.frame_range import frame_range
from fingervision.frames.source import Description
from fingervision.measuring.beside_damage import confirmed_beside_damage
from fingervision.measuring.camera_learning import Learn, learnt_first
from fingervision.measuring.changed_edges import ChangingEdges
from fingervision.measuring.frame_sequence import Judged, in_sequence
from fingervision.measuring.gap_budget import gap_budget
from fingervision.measuring.marked import marked
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.scale import other_camera
from fingervision.measuring.series import GapSeries
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.measuring.task import Task
from fingervision.measuring.temporal_filter import with_lag
from fingervision.storage.beside import recorded_camera
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.run_files import lost_frames
from fingervision.vision.defect_pixels import repaired
from fingervision.vision.pipeline import Settings

# Determine once per recording whether the fingers are darker or lighter than the background.
#
# If the user has not stated the polarity, the first frames decide by majority, because fingers do not change from dark
# to light within a recording. The majority excludes frames in which the bright regions on either side of a dark object
# look like two light fingers.

Outcome = GapMeasurement | NoGap | LostFrame
MeasureFrame = Callable[[Frame, Settings], GapMeasurement | NoGap]

# Number of frames with a gap that decide by majority, and largest number of pixels that are stored until the decision.
VOTERS, MOST_KEPT_PX = 15, 15_000_000


def one_polarity(
    frames: Iterable[Frame | LostFrame],
    settings: Settings,
    votes: Counter[str],
    is_stopped: Callable[[], bool] = lambda: False,
    measure: MeasureFrame | None = None,
) -> Iterator[tuple[Frame | LostFrame, Outcome]]:
    """Measure frames in order, all with the polarity found in most of the first frames that have a measured gap.

    Parameters
    ----------
    frames : iterable of Frame or LostFrame
        The recording; its frames are read once, in order.
    settings : Settings
        Settings of the measurement; a polarity stated in them is kept.
    votes : Counter of str
        Counter to which the numbers of first frames with `dark` and `light` fingers are added.
    is_stopped : callable
        Called after every frame; if it returns True no more frames are read, and the frames measured so far are still
        yielded.
    measure : callable or None
        Measurement of one frame, if not that of `ChangingEdges`.

    Yields
    ------
    (Frame or LostFrame, GapMeasurement or NoGap or LostFrame)
        Every frame with its result. The first frames with a gap are yielded after all of them have been counted; frames
        without a gap before them are yielded at once.
    """
    source, measure = iter(frames), measure or ChangingEdges().measure
    if settings.fingers_are_dark is None:
        kept: list[tuple[Frame | LostFrame, Outcome]] = []
        pixels = 0
        for item in source:
            outcome = measure(item, settings) if isinstance(item, Frame) else item
            if isinstance(outcome, GapMeasurement):
                votes["dark" if outcome.light_gap else "light"] += 1
            elif not votes:
                yield item, outcome
                if is_stopped():
                    return
                continue
            kept.append((item, outcome))
            pixels += item.pixels.size if isinstance(item, Frame) else 0
            if votes.total() >= VOTERS or pixels > MOST_KEPT_PX or is_stopped():
                break
        if votes:
            settings = replace(settings, fingers_are_dark=votes["dark"] >= votes["light"])
        for item, outcome in kept:
            is_other = isinstance(outcome, GapMeasurement) and outcome.light_gap != settings.fingers_are_dark
            yield item, measure(item, settings) if is_other and isinstance(item, Frame) else outcome
    while not is_stopped():
        following = next(source, None)
        if following is None:
            return
        yield following, measure(following, settings) if isinstance(following, Frame) else following


# Handle Ctrl-C and SIGTERM between two frames, so that no row of the table is incomplete.


@contextmanager
def asked_to_stop() -> Iterator[threading.Event]:
    """Record the first Ctrl-C or SIGTERM instead of raising it; a second signal is raised as usual.

    Signals are not recorded outside the main thread, nor in a worker process, whose parent process handles them.

    Yields
    ------
    threading.Event
        Event that is set by the first Ctrl-C or SIGTERM.
    """
    asked = threading.Event()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    if threading.current_thread() is not threading.main_thread() or not callable(before[signal.SIGINT]):
        yield asked
        return

    def note(number: int, frame: FrameType | None) -> None:
        restore()
        asked.set()

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    for number in before:
        signal.signal(number, note)
    try:
        yield asked
    finally:
        restore()


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

    def with_camera(self, camera: CameraModel) -> "Prepared":
        """Return the same with what was learnt about the camera."""
        return replace(self, settings=replace(self.settings, camera=camera))


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
    source: Iterable[Frame | LostFrame],
    how: Prepared,
    series: GapSeries,
    take_rows: TakeRows,
    see_item: SeeItem | None = None,
    on_progress: Progress | None = None,
    measure: MeasureFrame | None = None,
    learn: Learn | None = None,
) -> bool:
    """Measure a recording from its first frame to its last.

    Parameters
    ----------
    source : iterable of Frame or LostFrame
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
    measure : callable or None
        Measurement of one frame after the camera has been learnt, if not that of `ChangingEdges`.
    learn : callable or None
        What learns the camera from the first frames, if not `camera_of`.

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
            for item, outcome in _outcomes(items, how, series, asked.is_set, measure, learn):
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
    how: Prepared,
    series: GapSeries,
    is_stopped: Callable[[], bool],
    measure: MeasureFrame | None,
    learn: Learn | None,
) -> Iterator[tuple[Frame | LostFrame, GapMeasurement | NoGap | LostFrame]]:
    """Yield every frame with its result; the decoder runs ahead, and stops when this generator is closed."""
    pictures = SoundPictures()

    def judged(frames: Iterable[Frame | LostFrame]) -> Iterator[Judged]:
        settings = replace(how.settings, camera=series.camera)
        for item, outcome in one_polarity(frames, settings, series.votes, is_stopped, measure):
            if isinstance(item, LostFrame) or isinstance(outcome, LostFrame):
                yield item, outcome
            else:
                yield item, pictures.judged(item, outcome)

    with closing(decoded_ahead(source)) as frames:
        first, series.camera = learnt_first(
            coded(frames, how.description.coding), how.settings, how.row_maker.scale, is_stopped, learn
        )
        seen = (repaired(item, series.camera) if isinstance(item, Frame) else item for item in first)
        yield from with_lag(confirmed_beside_damage(in_sequence(judged(seen))), series.camera.lag)


def coded(frames: Iterable[Frame | LostFrame], coding: Coding) -> Iterator[Frame | LostFrame]:
    """Attach to losslessly stored frames the information on how their pictures had been compressed before."""
    for item in frames:
        if isinstance(item, Frame) and item.coding is Coding.LOSSLESS and coding is not Coding.LOSSLESS:
            yield replace(item, coding=coding)
        else:
            yield item

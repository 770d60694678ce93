"""The table of a run: measured while the run is recorded, from its own frames, as `measure` does it afterwards.

A recording has one camera, which is learnt from its first frames, and every frame is judged by those beside it. A live
view and a test bed cannot wait for either, but the table of a run can: its rows come from the loop that measures
recordings, so that both give the same. What has been measured with the same settings already is not measured again.

The measurement may fall behind: the camera is learnt in half a second on a quiet machine, in five where a wall, a line
or a shadow stands beside the edges, and in a minute beside programs that take the processor. Pictures beyond a fixed
amount of memory do not wait for it, but are read again from the video, which is written meanwhile.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from queue import Queue
from threading import Condition, Event, Thread

from fingervision.domain.camera import CameraModel
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.frames.seeking import VideoSeeking
from fingervision.frames.source import Description
from fingervision.measuring.camera_learning import Learn
from fingervision.measuring.changed_edges import ChangingEdges
from fingervision.measuring.frame_loop import measure_frames, prepared
from fingervision.measuring.rows import Result
from fingervision.measuring.series import GapSeries
from fingervision.measuring.task import Task
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.pipeline import Settings, contradicts

# Memory (bytes) and least number of pictures that wait for the measurement.
MEMORY_WAITING, FRAMES_WAITING = 32_000_000, 16
UNREADABLE = "The picture could not be read again from the recording."

Measured = tuple[Settings, GapMeasurement | NoGap]


@dataclass(frozen=True, slots=True)
class _InVideo:
    """A frame whose picture is read again from the video."""

    index: int
    time_s: float


class RunTable:
    """Measures the frames of a run in a thread of its own, and passes on their rows.

    Parameters
    ----------
    description : Description
        Description of the recording, with its video, to which each frame is written before it is added.
    task : Task
        Settings of the measurement.
    take : callable
        Called with the rows, in order, in the thread; an error that it raises is raised by `add` and `close`.
    learn : callable or None
        What learns the camera; `camera_beside` where frames come meanwhile.
    waits : bool
        Whether frames can wait, so that `add` need not return before there is room for their pictures.
    """

    def __init__(
        self,
        description: Description,
        task: Task,
        take: Callable[[Sequence[GapRow]], None],
        learn: Learn | None = None,
        *,
        waits: bool = False,
    ) -> None:
        self._description, self._task, self._take_rows, self._learn = description, task, take, learn
        self._video: VideoSeeking | None = None
        self.camera: CameraModel | None = None
        """Camera of the recording; None until it is learnt."""
        self.measured = 0
        """Number of rows that were passed on."""
        self._waiting: Queue[Frame | LostFrame | _InVideo | None] = Queue()
        self._room, self._waits = Condition(), waits
        self._pictures, self._newest, self._is_complete = 0, -1, False
        self._most = max(FRAMES_WAITING, MEMORY_WAITING // (description.width_px * description.height_px))
        self._seen: dict[int, tuple[Coding, Measured]] = {}
        self._edges = ChangingEdges()
        self._failure: Exception | None = None
        self._learnt = Event()
        self._thread = Thread(target=self._measure, name="Table", daemon=True)
        self._thread.start()

    def add(self, item: Frame | LostFrame, seen: Measured | None) -> None:
        """Add a frame with its number and time in the recording, and what the live view has measured in it."""
        if seen is not None and isinstance(item, Frame):
            self._seen[item.index] = item.coding, seen
        with self._room:
            if self._waits:
                self._room.wait_for(lambda: self._pictures < self._most or self._failure is not None)
            what: Frame | LostFrame | _InVideo = item
            if isinstance(item, Frame) and self._pictures >= self._most and item.time_s is not None:
                what = _InVideo(item.index, item.time_s)
            self._pictures += isinstance(what, Frame)
            self._newest = item.index
            self._room.notify_all()
        self._waiting.put(what)
        if self._failure is not None:
            raise self._failure

    def camera_once_learnt(self) -> CameraModel | None:
        """Wait until the camera is learnt; at least `camera_learning.WANTED` frames must have been added."""
        self._learnt.wait()
        return self.camera

    def close(self) -> None:
        """Measure all frames that wait, and end the thread; the video must be complete."""
        with self._room:
            self._is_complete = True
            self._room.notify_all()
        self._waiting.put(None)
        self._thread.join()
        if self._failure is not None:
            raise self._failure

    def _measure(self) -> None:
        first = self._waiting.get()  # the file states the coding of its levels from its first frame on
        if first is None:
            return
        try:
            how = prepared(self._description, self._task)
            # The frames come with their marks, which are in lost.csv for those who read the video.
            how = replace(how, description=replace(how.description, files=()))
            measure_frames(
                self._frames(first),
                how,
                GapSeries(),
                self._take,
                measure=self._outcome,
                learn=self._learn,
            )
        except Exception as error:  # raised where the next frame is added
            self._failure = error
        finally:
            self._learnt.set()
            with self._room:
                self._room.notify_all()

    def _frames(self, first: Frame | LostFrame | _InVideo) -> Iterator[Frame | LostFrame]:
        """Yield the frames in order, with pictures from the video where they did not wait."""
        item: Frame | LostFrame | _InVideo | None = first
        while item is not None:
            if isinstance(item, _InVideo):
                yield self._again(item)
            else:
                yield item
                if isinstance(item, Frame):
                    with self._room:
                        self._pictures -= 1
                        self._room.notify_all()
            item = self._waiting.get()

    def _again(self, item: _InVideo) -> Frame | LostFrame:
        """Read a frame from the video, where it is complete once another follows."""
        with self._room:
            self._room.wait_for(lambda: self._newest > item.index or self._is_complete)
        self._video = self._video or VideoSeeking(str(self._description.files[0]))
        # At the end of a file that is still written, a reader stops; another one goes on.
        found = self._video.frame(item.index, item.time_s) or self._video.frame(item.index, item.time_s)
        return found or LostFrame(item.index, item.time_s, Status.DAMAGED, UNREADABLE)

    def _take(self, _: Sequence[Result], rows: Sequence[GapRow]) -> None:
        self._take_rows(rows)
        self.measured += len(rows)

    def _outcome(self, frame: Frame, settings: Settings) -> GapMeasurement | NoGap:
        self.camera = settings.camera
        self._learnt.set()
        coding, seen = self._seen.pop(frame.index, (None, None))
        if seen is not None and coding is frame.coding and _holds(*seen, settings) and not contradicts(seen[1]):
            return seen[1]
        return self._edges.measure(frame, settings)


def _holds(known: Settings, outcome: GapMeasurement | NoGap, settings: Settings) -> bool:
    """Whether a result is that of other settings, too: a gap is the same if its polarity was found instead of given."""
    polarities = {known.fingers_are_dark}
    if known.fingers_are_dark is None and isinstance(outcome, GapMeasurement):
        polarities.add(outcome.light_gap)
    polarity = settings.fingers_are_dark
    return polarity in polarities and replace(known, fingers_are_dark=polarity) == settings

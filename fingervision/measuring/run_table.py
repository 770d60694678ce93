"""The table of a run: measured while the run is recorded, from its own frames, as `measure` does it afterwards.

A recording has one camera, which is learnt from its first frames, and every frame is judged by those beside it. A live
view and a test bed cannot wait for either, but the table of a run can: its rows come from the loop that measures
recordings, so that both give the same. What has been measured with the same settings already is not measured again.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from queue import Full, Queue
from threading import Event, Thread

from fingervision.domain.camera import CameraModel
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.frames.source import Description
from fingervision.measuring.camera_learning import Learn
from fingervision.measuring.changed_edges import ChangingEdges
from fingervision.measuring.frame_loop import measure_frames, prepared
from fingervision.measuring.rows import Result
from fingervision.measuring.series import GapSeries
from fingervision.measuring.task import Task
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.pipeline import Settings, contradicts

# Memory (bytes) and least number of frames that wait for the measurement: the camera is learnt in half a second on a
# quiet machine, and in five where a wall, a line or a shadow stands beside the edges; the video is written meanwhile.
# Interval (s) of the checks whether the thread still runs.
MEMORY_WAITING, FRAMES_WAITING, PATIENCE_S = 500_000_000, 100, 0.2

Measured = tuple[Settings, GapMeasurement | NoGap]


class RunTable:
    """Measures the frames of a run in a thread of its own, and passes on their rows.

    Parameters
    ----------
    description : Description
        Description of the recording, with its file.
    task : Task
        Settings of the measurement.
    take : callable
        Called with the rows, in order, in the thread; an error that it raises is raised by `add` and `close`.
    learn : callable or None
        What learns the camera; `camera_beside` where frames come meanwhile.
    """

    def __init__(
        self,
        description: Description,
        task: Task,
        take: Callable[[Sequence[GapRow]], None],
        learn: Learn | None = None,
    ) -> None:
        self._description, self._task, self._take_rows, self._learn = description, task, take, learn
        self.camera: CameraModel | None = None
        """Camera of the recording; None until it is learnt."""
        self._waiting: Queue[Frame | LostFrame | None] = Queue(
            max(FRAMES_WAITING, MEMORY_WAITING // (description.width_px * description.height_px))
        )
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
        self._put(item)
        if self._failure is not None:
            raise self._failure

    def camera_once_learnt(self) -> CameraModel | None:
        """Wait until the camera is learnt; at least `camera_learning.WANTED` frames must have been added."""
        self._learnt.wait()
        return self.camera

    def close(self) -> None:
        """Measure all frames that wait, and end the thread."""
        self._put(None)
        self._thread.join()
        if self._failure is not None:
            raise self._failure

    def _put(self, item: Frame | LostFrame | None) -> None:
        while self._thread.is_alive():
            with suppress(Full):
                self._waiting.put(item, timeout=PATIENCE_S)
                return

    def _measure(self) -> None:
        first = self._waiting.get()  # the file states the coding of its levels from its first frame on
        if first is None:
            return
        try:
            how = prepared(self._description, self._task)
            # The frames come with their marks, which are in lost.csv for those who read the video.
            how = replace(how, description=replace(how.description, files=()))
            measure_frames(
                chain((first,), iter(self._waiting.get, None)),
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

    def _take(self, _: Sequence[Result], rows: Sequence[GapRow]) -> None:
        self._take_rows(rows)

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

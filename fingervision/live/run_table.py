"""The table of a run: measured while the run is recorded, from its own frames, as `measure` does it afterwards.

A recording has one camera, which is learnt from its first frames, and every frame is judged by those beside it. The
live view cannot wait for either, but the table of a run can: it is written by the loop that measures recordings, so
that both give the same rows. What the live view has measured with the same settings is not measured again.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from pathlib import Path
from queue import Full, Queue
from threading import Thread

from fingervision.domain.camera import CameraModel
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.frames.source import Description
from fingervision.measuring.frame_loop import measure_frames, prepared
from fingervision.measuring.rows import Result
from fingervision.measuring.series import GapSeries
from fingervision.measuring.task import Task
from fingervision.storage.gaps_csv import GapRow, GapsCsv
from fingervision.vision.pipeline import Settings, measure_frame

# Memory (bytes) and least number of frames that wait for the measurement: the camera is learnt in half a second on a
# quiet machine, and in five where a wall, a line or a shadow stands beside the edges; the video is written meanwhile.
# Interval (s) of the checks whether the thread still runs.
MEMORY_WAITING, FRAMES_WAITING, PATIENCE_S = 500_000_000, 100, 0.2

Measured = tuple[Settings, GapMeasurement | NoGap]


class RunTable:
    """Measures the frames of a run in a thread of its own, and writes their rows.

    Parameters
    ----------
    path : Path
        The table.
    description : Description
        Description of the recording, with its file.
    task : Task
        Settings of the measurement.

    Raises
    ------
    OutputError
        The table cannot be written; every method may raise this error.
    """

    def __init__(self, path: Path, description: Description, task: Task) -> None:
        self._description, self._task = description, task
        self.camera: CameraModel | None = None
        """Camera of the recording; None until it is learnt."""
        self._rows = GapsCsv(path)
        self._waiting: Queue[Frame | LostFrame | None] = Queue(
            max(FRAMES_WAITING, MEMORY_WAITING // (description.width_px * description.height_px))
        )
        self._seen: dict[int, tuple[Coding, Measured]] = {}
        self._failure: Exception | None = None
        self._thread = Thread(target=self._measure, name="Table", daemon=True)
        self._thread.start()

    def add(self, item: Frame | LostFrame, seen: Measured | None) -> None:
        """Add a frame with its number and time in the recording, and what the live view has measured in it."""
        if seen is not None and isinstance(item, Frame):
            self._seen[item.index] = item.coding, seen
        self._put(item)
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """Write the rows of all frames that wait, and close the table."""
        self._put(None)
        self._thread.join()
        self._rows.close()
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
                chain((first,), iter(self._waiting.get, None)), how, GapSeries(), self._take, measure=self._outcome
            )
        except Exception as error:  # raised where the next frame is added
            self._failure = error

    def _take(self, _: Sequence[Result], rows: Sequence[GapRow]) -> None:
        self._rows.add(rows)

    def _outcome(self, frame: Frame, settings: Settings) -> GapMeasurement | NoGap:
        self.camera = settings.camera
        coding, seen = self._seen.pop(frame.index, (None, None))
        if seen is not None and coding is frame.coding and _holds(*seen, settings):
            return seen[1]
        return measure_frame(frame, settings)


def _holds(known: Settings, outcome: GapMeasurement | NoGap, settings: Settings) -> bool:
    """Whether a result is that of other settings, too: a gap is the same if its polarity was found instead of given."""
    polarities = {known.fingers_are_dark}
    if known.fingers_are_dark is None and isinstance(outcome, GapMeasurement):
        polarities.add(outcome.light_gap)
    polarity = settings.fingers_are_dark
    return polarity in polarities and replace(known, fingers_are_dark=polarity) == settings

"""Measurement of single frames of a live view, and their table rows."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ParamSpec, TypeVar

from fingervision.domain.camera import CameraModel, Origin
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.live.choices import Choices
from fingervision.live.run_folder import RunFolder
from fingervision.measuring.camera_learning import WANTED, camera_beside
from fingervision.measuring.changed_edges import ChangingEdges
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.measuring.task import Task
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.defect_pixels import repaired
from fingervision.vision.pipeline import Settings

P = ParamSpec("P")
T = TypeVar("T")

# The camera of a live view, learnt while frames arrive: assumed at first, known after a dozen frames with a gap. Frames
# that were measured before are measured again by the camera that was learnt, so that all rows have the same; they
# are kept until then, up to this number of pixels. By how much their gaps change is in the uncertainty of the others.
MOST_KEPT_PX = 60_000_000


class LiveCamera:
    """Learns the camera beside the measurement, so that no frame waits for it.

    Parameters
    ----------
    tell : callable
        Called with a sentence once the camera is known, or is known not to be learnable.
    again : callable
        Called in a thread of its own, once the camera is known, with the frames before, how to measure them, and the
        numbers of those behind them that were not kept.
    """

    def __init__(
        self, tell: Callable[[str], None], again: Callable[[Sequence[Frame], Settings, Task, range], None]
    ) -> None:
        self._tell, self._told, self._again = tell, "", again
        self._key: tuple[object, object] = (None, None)
        self._frames: list[Frame] = []
        self._left_out = range(0)
        self._learning: Future[CameraModel] | None = None
        self._measuring: Future[None] | None = None
        self._camera: CameraModel | None = None

    def used(self, settings: Settings, task: Task, run: RunFolder | None) -> Settings:
        """Settings with the camera as far as it is known; another scale or response starts again.

        A run learns its camera from its own frames, and the view takes it over; until then, the view's own counts.
        """
        if self._key[0] is not task.scale or self._key[1] is not task.response:
            self._key, self._frames, self._learning, self._camera = (task.scale, task.response), [], None, None
        camera = None if run is None else run.camera
        if camera is not None:
            self._learning = None
        elif self._learning is not None and self._learning.done():
            camera, self._learning = self._learning.result(), None
        if self._measuring is not None and self._measuring.done():
            self._measuring.result()  # raises what failed there
        if camera is None or camera is self._camera:
            return settings if self._camera is None else replace(settings, camera=self._camera)
        self._know(camera)
        settings, frames, self._frames = replace(settings, camera=camera), self._frames, []
        if frames:
            self._measuring = _in_a_thread(self._again, frames, settings, task, self._left_out)
        return settings

    def add(self, frame: Frame, settings: Settings, task: Task, *, learns: bool) -> None:
        """Add a frame with a gap; enough frames start the learning, unless another learns."""
        if self._camera is not None:
            return
        if (len(self._frames) + 1) * frame.pixels.size < MOST_KEPT_PX or len(self._frames) < WANTED:
            self._frames.append(replace(frame, pixels=frame.pixels.copy()))
            self._left_out = range(frame.index + 1, frame.index + 1)
        else:
            self._left_out = range(self._left_out.start, frame.index + 1)
        if learns and self._learning is None and len(self._frames) >= WANTED:
            self._learning = _in_a_thread(camera_beside, self._frames[-WANTED:], settings, task.scale)

    def _know(self, camera: CameraModel) -> None:
        self._camera = camera
        words = "" if camera.response.is_known else _in_words(camera)
        if words and words != self._told:
            self._told = words
            self._tell(words)


def _in_a_thread(work: Callable[P, T], *given: P.args, **named: P.kwargs) -> "Future[T]":
    pool = ThreadPoolExecutor(1, "camera")
    found = pool.submit(work, *given, **named)
    pool.shutdown(wait=False)
    return found


def _in_words(camera: CameraModel) -> str:
    response = camera.response
    if response.words:
        return response.words
    if response.origin is not Origin.LEARNT:
        return "The camera's response could not be learnt from these frames; u_shift_px contains another usual one."
    spread = camera.point_spread
    blur = "" if spread is None else f", and its blur is {spread.sigma_px.value:.2f} px"
    return f"The camera is known now: its response is {response.curve.name}{blur}."


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The most recent frame with its result.

    Parameters
    ----------
    frame : Frame
        The frame with its picture.
    outcome : GapMeasurement, NoGap or None
        Result of the measurement; None until the scale is known.
    row : GapRow or None
        Row of the frame as in gaps.csv; None until the scale is known.
    """

    frame: Frame
    outcome: GapMeasurement | NoGap | None
    row: GapRow | None


class FrameMeasurement:
    """Measures the frames of one source in order, in the same way as those of a recording.

    Parameters
    ----------
    frame_size_px : (int, int)
        Width and height of the frames.
    files : tuple of Path
        Files of a recording, whose metadata may state the coding of grey levels; empty for a live source.
    fingers_are_dark : bool or None
        Whether the fingers are darker than the background; None to detect this in every frame.
    tell : callable
        Called with a sentence once the camera has been learnt.
    again : callable
        Called in a thread of its own, once the camera has been learnt, with new rows of the frames with a gap before,
        and the numbers of those that were not kept.
    """

    def __init__(
        self,
        frame_size_px: tuple[int, int],
        files: tuple[Path, ...] = (),
        fingers_are_dark: bool | None = None,
        tell: Callable[[str], None] = lambda words: None,
        again: Callable[[Sequence[GapRow], range], None] = lambda rows, left_out: None,
    ) -> None:
        self._frame_size_px, self._files, self._fingers_are_dark = frame_size_px, files, fingers_are_dark
        self._pictures, self._camera = SoundPictures(), LiveCamera(tell, self._measure_again)
        self._edges = ChangingEdges()
        self._take_again = again
        self.settings: Settings | None = None
        """Settings with which the last frame was measured."""

    def measured(
        self, item: Frame | LostFrame, choices: Choices, run: RunFolder | None = None
    ) -> tuple[Frame | LostFrame, GapMeasurement | NoGap | None, GapRow | None]:
        """Measure a frame.

        Parameters
        ----------
        item : Frame or LostFrame
            The frame as received.
        choices : Choices
            Settings chosen by the user.
        run : RunFolder or None
            The run that is being recorded.

        Returns
        -------
        item : Frame or LostFrame
            The same frame, or a lost frame if the picture proved to be damaged.
        outcome : GapMeasurement, NoGap or None
            Result of the measurement; None for a lost frame, and until the scale is known.
        row : GapRow or None
            Row of the frame as in gaps.csv; None until the scale is known.
        """
        task = choices.task
        if task is None:
            return item, None, None
        found: GapMeasurement | NoGap | LostFrame = (
            item if isinstance(item, LostFrame) else self._found(item, choices, run)
        )
        (row,) = RowMaker(task.scale, self._frame_size_px).rows((Result(item.index, item.time_s, found),))
        if isinstance(found, LostFrame):
            return found, None, row
        return item, found, row

    def _found(self, frame: Frame, choices: Choices, run: RunFolder | None) -> GapMeasurement | NoGap | LostFrame:
        assert choices.task is not None  # noqa: S101 - asked before
        settings = self._camera.used(choices.task.settings_for(self._files)[0], choices.task, run)
        if self._fingers_are_dark is not None:
            settings = replace(settings, fingers_are_dark=self._fingers_are_dark)
        self.settings = settings
        frame = repaired(frame, settings.camera)
        outcome = self._pictures.judged(frame, self._edges.measure(frame, settings))
        if isinstance(outcome, GapMeasurement):
            self._camera.add(frame, settings, choices.task, learns=run is None)
        return outcome

    def _measure_again(self, frames: Sequence[Frame], settings: Settings, task: Task, left_out: range) -> None:
        edges = ChangingEdges()
        found = [
            Result(frame.index, frame.time_s, edges.measure(repaired(frame, settings.camera), settings))
            for frame in frames
        ]
        self._take_again(RowMaker(task.scale, self._frame_size_px).rows(found), left_out)

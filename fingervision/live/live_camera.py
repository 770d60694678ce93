"""The camera of a live view, learnt while frames arrive: assumed at first, known after a dozen frames with a gap."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

from fingervision.domain.camera import CameraModel, Origin
from fingervision.domain.frame import Frame
from fingervision.measuring.camera_learning import WANTED, camera_of
from fingervision.measuring.task import Task
from fingervision.vision.pipeline import Settings


class LiveCamera:
    """Learns the camera in a thread of its own, so that no frame waits for it.

    Parameters
    ----------
    tell : callable
        Called with a sentence once the camera is known, or is known not to be learnable.
    """

    def __init__(self, tell: Callable[[str], None] = lambda words: None) -> None:
        self._tell = tell
        self._key: tuple[object, object] = (None, None)
        self._frames: list[Frame] = []
        self._learning: Future[CameraModel] | None = None
        self._camera: CameraModel | None = None

    def used(self, settings: Settings, task: Task) -> Settings:
        """Settings with the camera as far as it is known; another scale or response starts again."""
        if self._key[0] is not task.scale or self._key[1] is not task.response:
            self._key, self._frames, self._learning, self._camera = (task.scale, task.response), [], None, None
        if self._learning is not None and self._learning.done():
            self._camera, self._learning = self._learning.result(), None
            self._tell(_in_words(self._camera))
        return settings if self._camera is None else replace(settings, camera=self._camera)

    def add(self, frame: Frame, settings: Settings, task: Task) -> None:
        """Add a frame with a gap; enough frames start the learning."""
        if settings.camera.response.is_known or self._camera is not None or self._learning is not None:
            return
        self._frames.append(replace(frame, pixels=frame.pixels.copy()))
        if len(self._frames) >= WANTED:
            frames, self._frames = self._frames, []
            pool = ThreadPoolExecutor(1, "camera")
            self._learning = pool.submit(camera_of, frames, settings, task.scale)
            pool.shutdown(wait=False)


def _in_words(camera: CameraModel) -> str:
    response = camera.response
    if response.words:
        return response.words
    if response.origin is not Origin.LEARNT:
        return "The camera's response could not be learnt from these frames; u_shift_px contains another usual one."
    spread = camera.point_spread
    blur = "" if spread is None else f", and its blur is {spread.sigma_px.value:.2f} px"
    return f"The camera is known now: its response is {response.curve.name}{blur}."

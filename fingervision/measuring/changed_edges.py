"""Frames that show other things beside their edges than the first ones: learnt from again as the recording goes on."""

from dataclasses import replace

from fingervision.domain.camera import BesideEdges
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.learnt_scene import less_sure
from fingervision.vision.pipeline import Settings, contradicts, measure_frame
from fingervision.vision.single_picture import FEWEST_PREDICTED, beside_in

# Numbers of such frames before it that a frame is learnt from: ever fewer, because learning may take seconds.
LEARNT_FROM = (0, FEWEST_PREDICTED - 1, 25, 250, 2_500, 25_000)


class ChangingEdges:
    """Measures the frames of one recording in order."""

    def __init__(self) -> None:
        self._frames: list[Frame] = []
        self._count = 0
        self._beside: BesideEdges | None = None

    def measure(self, frame: Frame, settings: Settings) -> GapMeasurement | NoGap:
        """Measure a frame; one that contradicts what was learnt from the first frames is learnt from as well.

        Parameters
        ----------
        frame : Frame
            The next frame.
        settings : Settings
            Settings with the camera as learnt from the first frames.
        """
        outcome = measure_frame(frame, settings)
        if not contradicts(outcome):
            return outcome
        self._frames = [*self._frames[1 - FEWEST_PREDICTED :], replace(frame, pixels=frame.pixels.copy())]
        if self._count in LEARNT_FROM:
            bare = replace(settings, camera=replace(settings.camera, beside=None))
            known = settings.camera.beside
            # Another tone curve that explained the first frames as well remains a rival.
            rivals_px = known.u_gap_px if known is not None and not known.name else 0.0
            self._beside = less_sure(beside_in(self._frames, bare), rivals_px)
        self._count += 1
        if frame.coding is Coding.INTERFRAME and self._count < FEWEST_PREDICTED:
            return outcome
        return measure_frame(frame, replace(settings, camera=replace(settings.camera, beside=self._beside)))

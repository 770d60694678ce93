"""What stands beside the edges in one picture or a few, from which no camera can be learnt."""

from collections.abc import Sequence
from dataclasses import replace

from fingervision.domain.camera import BesideEdges
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.one_thread import one_thread
from fingervision.vision.grey import to_grey, top_level
from fingervision.vision.learnt_scene import learnt_beside
from fingervision.vision.pipeline import Settings, measure_frame, steps_alone

# Fewest pictures of a codec that predicts them from each other.
FEWEST_PREDICTED = 3


def measure_picture(frame: Frame, settings: Settings) -> GapMeasurement | NoGap:
    """Measure one picture by itself, with what it shows beside the edges; see `pipeline.measure_frame`."""
    beside = beside_in([frame], settings)
    return measure_frame(frame, replace(settings, camera=replace(settings.camera, beside=beside)))


def beside_in(frames: Sequence[Frame], settings: Settings) -> BesideEdges | None:
    """Walls, bright lines and shadows beside the edges; None if none are told.

    A codec that predicts pictures from others displaces the edges of few pictures in ways that look like them.

    Parameters
    ----------
    frames : sequence of Frame
        The pictures.
    settings : Settings
        Settings of the measurement.
    """
    with one_thread():
        looks = [(frame, look) for frame in frames if (look := steps_alone(frame, settings)) is not None]
        are_dark = {is_dark for _, (_, is_dark, _) in looks}
        if len(are_dark) != 1 or (looks[0][0].coding is Coding.INTERFRAME and len(looks) < FEWEST_PREDICTED):
            return None
        top = max(top_level(to_grey(frame.pixels), settings.bits) for frame, _ in looks)
        seen, coding = [seen for _, (seen, _, _) in looks], looks[0][0].coding
        return learnt_beside(seen, settings.camera.response, top, coding, are_dark=are_dark.pop())

"""Requests to the camera: change exposure, gain, focus or frame rate during operation."""

from dataclasses import asdict
from typing import Any

from fingervision.domain.errors import FingervisionError, StateError
from fingervision.frames.controls import FRAME_RATE, MOVES_SCALE, about_change
from fingervision.live.commands.asking import Answer, Request, number, words
from fingervision.live.session import Session
from fingervision.live.view import View
from fingervision.measuring.scale import other_camera


class CameraError(FingervisionError):
    """A camera setting cannot be changed; the browser page shows the error's sentence beside the named setting.

    Parameters
    ----------
    field : str
        Name of the setting.
    words : str
        Sentence that states the reason.
    """

    def __init__(self, field: str, words: str) -> None:
        super().__init__(words)
        self.field = field


def _set(view: View, request: Request) -> Answer:
    name = words(request, "name")
    try:
        return _changed(view, name, number(request, "value"))
    except FingervisionError as error:
        raise CameraError(name, str(error)) from error


def _changed(view: View, name: str, value: float) -> Answer:
    if not isinstance(view, Session):
        raise StateError("The camera settings of a recording cannot be changed.")
    if view.ended.is_set():
        raise StateError("The source has ended: its camera settings cannot be changed.")
    if view.recording is not None and name in MOVES_SCALE:
        raise StateError(
            f"A change of {name} changes the scale, but a run has a single scale: end the recording first."
        )
    before, after = view.capture.adjustments.ask(name, value)
    if name == FRAME_RATE:
        view.cadence.restart()
    said = about_change(before, after, value)
    view.say("camera", said)
    scale = view.choices.scale
    if name in MOVES_SCALE and scale is not None:
        view.say("camera", f"The {name} has changed the scale: calibrate again before you use a gap.")
    elif note := other_camera(scale, view.capture.source.description.camera):
        view.say("camera", note)
    return Answer(said, more={"name": name, "value": after.value})


def section(view: View) -> dict[str, Any]:
    """Return the camera's settings that can be changed, for the browser page."""
    controls = view.capture.adjustments.controls if isinstance(view, Session) else ()
    return {"camera_controls": [asdict(each) for each in controls]}


COMMANDS = {"set_camera": _set}

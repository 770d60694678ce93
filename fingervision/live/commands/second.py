"""Requests about the second recording that is shown beside the first."""

from typing import Any

from fingervision.domain.errors import StateError
from fingervision.live.commands.asking import Answer, Request, number
from fingervision.live.playback.second_recording import SECOND, SecondRecording
from fingervision.live.view import View


def _shift(view: View, request: Request) -> Answer:
    second = view.features.get(SECOND)
    if not isinstance(second, SecondRecording):
        raise StateError("There is no second recording: name one with --beside.")
    second.shift(number(request, "offset_s"))
    return Answer(f"{second.offset_s:g} s are added to the times of the recording beside.")


def section(view: View) -> dict[str, Any]:
    """Return the state of the second recording for the browser page."""
    second = view.features.get(SECOND)
    return {"second": second.described() if isinstance(second, SecondRecording) else None}


COMMANDS = {"shift_second": _shift}

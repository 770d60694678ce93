"""Requests about the model for comparison, and about an input entered by the user."""

from typing import TYPE_CHECKING, Any

from fingervision.domain.errors import StateError
from fingervision.frames.source import Driven
from fingervision.live.commands.asking import Answer, Request, number_or_none
from fingervision.live.session import Session
from fingervision.live.view import View

if TYPE_CHECKING:
    from fingervision.live.comparison.comparison import Comparison

MODEL, TYPED = "model", "typed_input"


def _input(view: View, request: Request) -> Answer:
    if not isinstance(view, Session):
        raise StateError("The input of a recording cannot be typed: it is read from the log of the stage.")
    if "bed" in view.features:
        raise StateError(
            "The input cannot be typed while a test bed is connected: it is read from the test bed's stage."
        )
    input_mm = number_or_none(request, "input_mm")
    view.features[TYPED] = input_mm
    if input_mm is None:
        view.driven_at = lambda time_s: None
        return Answer("From now on, the input is not known.")
    view.driven_at = lambda time_s: Driven(input_mm)
    return Answer(f"The input is {input_mm:g} mm from now on.")


def section(view: View) -> dict[str, Any]:
    """Return prediction, residual and verdict for the browser page."""
    comparison: Comparison | None = view.features.get(MODEL)
    return {"model": None if comparison is None else comparison.state()}


COMMANDS = {"input": _input}

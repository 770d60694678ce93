"""Camera latency: frames carry a time stamp later than their exposure."""

from dataclasses import replace

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck, PictureForm
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response
from fingervision.effects.time_delay import delay_that_shows, late


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: frames carry a time stamp later than their exposure."""
    return _stamped(response, history, values, curved=False)


def act_curved(response: Response, history: History, values: Values) -> Response:
    """Apply the effect to points whose positions over time are curved, not linear, between the frames."""
    return _stamped(response, history, values, curved=True)


def _stamped(response: Response, history: History, values: Values, *, curved: bool) -> Response:
    if values["delay_s"] == 0.0:
        return response
    left_mm, right_mm = (
        late(edge_mm, history, values["delay_s"], curved=curved) for edge_mm in (response.left_mm, response.right_mm)
    )
    return replace(response, left_mm=left_mm, right_mm=right_mm)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    return delay_that_shows(history, EFFECT.parameters[0])


EFFECT = PointEffect(
    name="camera_latency",
    stage=Stage.CAMERA,
    order=250,
    words="the time stamps of the frames are too late",
    formula="every position at time t - delay_s",
    source="a pure delay",
    residual="proportional to the speed of the measuring points, including their drifts",
    parameters=(Parameter("delay_s", "s", 0.0, 1.0, "delay of the picture", starts=8, logarithmic=True),),
    needs_times=True,
    narrow=narrow,
    checks={FurtherCheck.LIGHT: True},
    delay_s=lambda values: values["delay_s"],
    in_picture=lambda values: PictureForm(late_s=values["delay_s"]),
    act=act,
    act_curved=act_curved,
)

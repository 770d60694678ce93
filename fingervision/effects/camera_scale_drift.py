"""Camera scale drift: the scale changes slowly because focus or zoom creeps."""

from dataclasses import replace

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the scale changes slowly because focus or zoom creeps."""
    return replace(
        response,
        left_mm=response.left_mm * (1.0 + values["rate_per_s"] * history.clock_s),
        right_mm=response.right_mm * (1.0 + values["rate_per_s"] * history.clock_s),
    )


EFFECT = PointEffect(
    name="camera_scale_drift",
    stage=Stage.CAMERA,
    order=190,
    words="focus or zoom creeps, which changes the scale",
    formula="x (1 + rate_per_s t)",
    source="definition",
    residual="proportional to the distance from the image centre, and to time",
    parameters=(Parameter("rate_per_s", "1/s", -0.001, 0.001, "relative change of the scale", typical=1e-4),),
    needs_times=True,
    needs_shared_clock=True,
    act=act,
)

"""Camera drift: the camera or its clamp moves, which shifts both measuring points together."""

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the camera moves, which shifts both measuring points together."""
    return response.shifted(values["rate_mm_per_s"] * history.clock_s)


EFFECT = PointEffect(
    name="camera_drift",
    stage=Stage.CAMERA,
    order=180,
    words="the camera or its clamp moves, which shifts both measuring points alike",
    formula="x + rate_mm_per_s t",
    source="definition",
    residual="a midline that moves evenly in time; the gap is unchanged",
    parameters=(Parameter("rate_mm_per_s", "mm/s", -0.05, 0.05, "drift of the camera", typical=0.001),),
    needs_times=True,
    needs_shared_clock=True,
    needs_edges=True,
    checks={FurtherCheck.TURN: False},
    odd=("rate_mm_per_s",),
    demonstrated=True,
    act=act,
)

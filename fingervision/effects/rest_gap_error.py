"""Rest gap error: the gap of the fingers at rest differs from that of the model."""

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the gap of the fingers at rest differs from that of the model."""
    return response.with_gap(response.gap_mm + values["offset_mm"])


EFFECT = PointEffect(
    name="rest_gap_error",
    stage=Stage.MECHANISM,
    order=130,
    words="the gap at rest differs from that of the model",
    formula="g + offset_mm, symmetric",
    source="definition",
    residual="a constant offset of the gap, the same in all runs",
    parameters=(Parameter("offset_mm", "mm", -2.0, 2.0, "offset of the gap at rest", typical=0.5),),
    like_wrong_zero=True,
    checks={FurtherCheck.SLOT: False, FurtherCheck.REZERO: False},
    act=act,
)

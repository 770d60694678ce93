"""Edge bias: the threshold or sensor blooming displaces both edges."""

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: threshold or sensor blooming displaces both edges."""
    return response.with_gap(response.gap_mm + values["offset_mm"])


EFFECT = PointEffect(
    name="edge_bias",
    stage=Stage.CAMERA,
    order=240,
    words="threshold or blooming displaces both edges",
    formula="g + offset_mm",
    source="definition",
    residual="a constant offset of the gap",
    parameters=(Parameter("offset_mm", "mm", -0.1, 0.1, "offset of the measured gap", typical=0.03),),
    like_wrong_zero=True,
    checks={FurtherCheck.SLOT: True},
    act=act,
)

"""Lever ratio error: the ratio of gap to input differs, because of a link length or a hinge position."""

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the ratio of gap to input differs, because of a link length or a hinge position."""
    opening_mm = response.gap_mm - history.rest_gap_mm
    return response.with_gap(history.rest_gap_mm + (1.0 + values["ratio"]) * opening_mm)


EFFECT = PointEffect(
    name="lever_ratio_error",
    stage=Stage.MECHANISM,
    order=90,
    words="the motion ratio differs from the model (link length, hinge position)",
    formula="o (1 + ratio)",
    source="definition",
    residual="proportional to the opening",
    parameters=(Parameter("ratio", "", -0.3, 0.3, "relative error of the lever ratio", typical=0.1),),
    checks={FurtherCheck.SLOT: False, FurtherCheck.TRAVEL: False},
    in_drawing=DrawingForm(
        DrawnPart.LINKS_ALIKE, Parameter("ratio", "", -0.3, 0.3, "relative error of the opening", typical=0.01)
    ),
    act=act,
)

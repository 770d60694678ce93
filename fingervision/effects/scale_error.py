"""Scale error: the scale of the picture (px/mm) is wrong by a constant factor."""

from dataclasses import replace

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the scale of the picture (px/mm) is wrong by a constant factor."""
    return replace(
        response,
        left_mm=response.left_mm * (1.0 + values["ratio"]),
        right_mm=response.right_mm * (1.0 + values["ratio"]),
    )


EFFECT = PointEffect(
    name="scale_error",
    stage=Stage.CAMERA,
    order=210,
    words="the camera scale (px/mm) is wrong",
    formula="x (1 + ratio)",
    source="definition",
    residual="proportional to the gap",
    parameters=(Parameter("ratio", "", -0.2, 0.2, "relative error of the scale", typical=0.02),),
    checks={FurtherCheck.SLOT: True},
    in_drawing=DrawingForm(
        DrawnPart.PICTURE, Parameter("ratio", "", -0.2, 0.2, "relative error", typical=0.01), reference=0.01
    ),
    act=act,
)

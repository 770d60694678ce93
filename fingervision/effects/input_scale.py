"""Input scale error: the recorded input has a wrong scale factor."""

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: the recorded input has a wrong scale factor."""
    return (1.0 + values["ratio"]) * input_mm


EFFECT = DriveEffect(
    name="input_scale",
    stage=Stage.DRIVE,
    order=30,
    words="the unit (scale) of the recorded input is wrong",
    formula="(1 + ratio) u",
    source="definition",
    residual="proportional to the input",
    parameters=(Parameter("ratio", "", -0.3, 0.3, "relative error of the unit", typical=0.02),),
    checks={FurtherCheck.TRAVEL: True},
    in_drawing=DrawingForm(
        DrawnPart.INPUT, Parameter("ratio", "", -0.3, 0.3, "relative error", typical=0.01), reference=0.01
    ),
    act=act,
)

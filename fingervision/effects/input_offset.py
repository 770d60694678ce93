"""Input offset: the zero of the recorded input is wrong."""

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: the zero of the recorded input is wrong until the stage is re-zeroed."""
    out = input_mm + values["offset_mm"]
    for run, rezeroed in zip(history.runs, history.rezeroed, strict=False):
        if rezeroed:
            out[run] = input_mm[run]
    return out


EFFECT = DriveEffect(
    name="input_offset",
    stage=Stage.DRIVE,
    order=20,
    words="the zero of the recorded input is displaced",
    formula="u + offset_mm; u after a re-zeroing",
    source="definition",
    residual="nearly a constant offset; if the model is curved, proportional to its slope",
    parameters=(Parameter("offset_mm", "mm", -0.5, 0.5, "offset of the input", typical=0.05),),
    like_wrong_zero=True,
    checks={FurtherCheck.REZERO: True},
    in_drawing=DrawingForm(
        DrawnPart.CONSTANT, Parameter("offset_mm", "mm", -0.5, 0.5, "offset of the input", typical=0.05)
    ),
    act=act,
)

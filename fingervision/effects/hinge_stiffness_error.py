"""Hinge stiffness error (Young's modulus, hinge thickness): the force differs, while the gap hardly differs."""

from dataclasses import replace

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the force differs (Young's modulus, hinge thickness), while the gap hardly differs."""
    return (
        response if response.force_n is None else replace(response, force_n=(1.0 + values["ratio"]) * response.force_n)
    )


EFFECT = PointEffect(
    name="hinge_stiffness_error",
    stage=Stage.MECHANISM,
    order=170,
    words="the hinges are stiffer or softer than modelled (modulus, hinge thickness)",
    formula="force (1 + ratio)",
    source="linear elasticity",
    residual="an error of the force only, in proportion to the force; the gap is unchanged",
    parameters=(Parameter("ratio", "", -0.9, 0.9, "relative error of the stiffness"),),
    needs_force=True,
    in_drawing=DrawingForm(
        DrawnPart.HINGE, Parameter("ratio", "", -0.9, 0.9, "relative error", typical=0.1), reference=0.05
    ),
    act=act,
)

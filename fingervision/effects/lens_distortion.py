"""Lens distortion: radial distortion of the picture about the image centre."""

from dataclasses import replace

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck, PictureForm
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: radial distortion of the picture about the image centre."""
    return replace(
        response,
        left_mm=response.left_mm * (1.0 + values["k_per_mm2"] * response.left_mm**2),
        right_mm=response.right_mm * (1.0 + values["k_per_mm2"] * response.right_mm**2),
    )


EFFECT = PointEffect(
    name="lens_distortion",
    stage=Stage.CAMERA,
    order=220,
    words="the lens has radial distortion about the image centre",
    formula="x (1 + k_per_mm2 x^2)",
    source="Brown 1966, first radial term",
    residual="proportional to the cube of the distance from the image centre",
    parameters=(Parameter("k_per_mm2", "1/mm2", -0.005, 0.005, "first radial coefficient", typical=0.0005),),
    checks={FurtherCheck.SLOT: True, FurtherCheck.SHIFT: True},
    in_picture=lambda values: PictureForm(radial_per_mm2=values["k_per_mm2"]),
    demonstrated=True,
    act=act,
)

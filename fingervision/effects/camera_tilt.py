"""Camera tilt: the plane of the fingers is not parallel to the sensor, which causes keystone distortion."""

from dataclasses import replace

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck, PictureForm
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the plane of the fingers is tilted, which causes keystone distortion."""
    return replace(
        response,
        left_mm=response.left_mm / (1.0 + values["k_per_mm"] * response.left_mm),
        right_mm=response.right_mm / (1.0 + values["k_per_mm"] * response.right_mm),
    )


EFFECT = PointEffect(
    name="camera_tilt",
    stage=Stage.CAMERA,
    order=230,
    words="the plane of the fingers is tilted against the image plane (keystone)",
    formula="x / (1 + k_per_mm x)",
    source="central projection of a tilted plane",
    residual="proportional to the squared distance from the image centre: the midline moves with the opening squared",
    parameters=(
        Parameter("k_per_mm", "1/mm", -0.02, 0.02, "keystone, change of the scale across the picture", typical=0.002),
    ),
    needs_edges=True,
    checks={FurtherCheck.TURN: False},
    odd=("k_per_mm",),
    in_picture=lambda values: PictureForm(keystone_per_mm=values["k_per_mm"]),
    demonstrated=True,
    act=act,
)

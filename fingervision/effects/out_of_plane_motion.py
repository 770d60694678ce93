"""Out-of-plane motion: the tips move towards the camera or away from it as they open."""

from dataclasses import replace

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response

MOST_CHANGE = 0.5
"""Largest relative change of the distance between camera and tips: the tips cannot come to the camera's lens."""


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the tips move towards the camera or away from it as they open."""
    return replace(
        response,
        left_mm=response.left_mm / (1.0 - values["relative_per_mm"] * (response.gap_mm - history.rest_gap_mm)),
        right_mm=response.right_mm / (1.0 - values["relative_per_mm"] * (response.gap_mm - history.rest_gap_mm)),
    )


def narrow(history: History) -> tuple[Parameter, ...]:
    """Limit the change of the camera's distance over the whole opening: beyond it, the projection has no sense."""
    (relative,) = EFFECT.parameters
    most = min(relative.upper, MOST_CHANGE / max(history.opening_mm, 1e-12))
    return (replace(relative, lower=-most, upper=most),)


EFFECT = PointEffect(
    name="out_of_plane_motion",
    stage=Stage.CAMERA,
    order=200,
    words="the tips move towards or away from the camera as they open",
    formula="x / (1 - relative_per_mm (g - g0))",
    source="central projection",
    residual="a curve: proportional to the gap times the opening",
    parameters=(
        Parameter(
            "relative_per_mm", "1/mm", -0.02, 0.02, "relative change of the camera distance per opening", typical=0.002
        ),
    ),
    checks={FurtherCheck.SHIFT: False},
    act=act,
    narrow=narrow,
)

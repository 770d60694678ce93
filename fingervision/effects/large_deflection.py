"""Large deflection: the links rotate by angles that are not small."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the links rotate by angles that are not small."""
    if values["reach_mm"] == 0.0:  # no arc given
        return response
    reach_mm, opening_mm = values["reach_mm"], response.gap_mm - history.rest_gap_mm
    angle = opening_mm / reach_mm
    bent_mm = reach_mm * np.sin(angle) + values["cross"] * reach_mm * (1.0 - np.cos(angle))
    return response.with_gap(history.rest_gap_mm + bent_mm)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    reach, cross = EFFECT.parameters
    return replace(reach, lower=0.5 * history.opening_mm, upper=1000.0 * history.opening_mm, neutral=None), cross


EFFECT = PointEffect(
    name="large_deflection",
    stage=Stage.MECHANISM,
    order=100,
    words="the links rotate so far that the motion is no longer linear",
    formula="L sin(o / L) + c L (1 - cos(o / L)), L = reach_mm, c = cross",
    source="a point on a circular arc",
    residual="a curve: a parabola plus a cubic of the opening",
    parameters=(
        Parameter("reach_mm", "mm", 0.001, 10000.0, "radius of the arc", neutral=None, starts=4, logarithmic=True),
        Parameter("cross", "", -2.0, 2.0, "share of the motion along the radius"),
    ),
    narrow=narrow,
    checks={FurtherCheck.SHIFT: False},
    act=act,
)

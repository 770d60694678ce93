"""End stop: the stage stops before it reaches the commanded position."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: the stage stops before it reaches the commanded position."""
    return np.maximum(np.minimum(input_mm, values["upper_mm"]), values["lower_mm"])


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    lowest, highest = float(history.input_mm.min()), float(history.input_mm.max())
    upper, lower = EFFECT.parameters
    return (
        replace(upper, lower=lowest, upper=highest, neutral=highest),
        replace(lower, lower=lowest, upper=highest, neutral=lowest),
    )


EFFECT = DriveEffect(
    name="end_stop",
    stage=Stage.DRIVE,
    order=50,
    words="the stage stops at an end stop before it reaches the recorded input",
    formula="min(u, upper_mm), max(., lower_mm)",
    source="definition",
    residual="zero up to the stop; beyond the stop, the missing input times the slope of the model",
    parameters=(
        Parameter("upper_mm", "mm", -1e3, 1e3, "input at the upper stop", neutral=1e3, starts=10, place=True),
        Parameter("lower_mm", "mm", -1e3, 1e3, "input at the lower stop", neutral=-1e3, starts=10, place=True),
    ),
    narrow=narrow,
    checks={FurtherCheck.FORCE: False},
    stands_at=("closed", "open"),
    drawn_with={"upper_mm": 1.3, "lower_mm": -0.4},
    demonstrated=True,
    act=act,
)

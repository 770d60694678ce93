"""Friction hysteresis: a smooth loop of output over input, independent of speed."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values, start_key
from fingervision.domain.parameter import Parameter
from fingervision.effects.play_operator import drawn_sliders


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: a smooth hysteresis loop, independent of speed."""
    out = np.empty_like(input_mm)
    for index, run in enumerate(history.runs):
        start = values.get(start_key(index), 0.0)
        lag = drawn_sliders(input_mm[run], values["reach_mm"], 8, start)
        out[run] = input_mm[run] - values["fraction"] * lag / 8.0
    return out


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    fraction, reach = EFFECT.parameters
    return fraction, replace(reach, lower=0.02 * history.input_span_mm, upper=0.6 * history.input_span_mm)


EFFECT = DriveEffect(
    name="friction_hysteresis",
    stage=Stage.DRIVE,
    order=80,
    words="friction makes the motion follow a smooth hysteresis loop, independent of speed",
    formula="u - fraction * mean of eight elastic sliders, each clipped to reach_mm k / 8",
    source="Iwan 1966; Maxwell slip",
    residual="a lens-shaped loop over the input that closes at the reversals",
    parameters=(
        Parameter("fraction", "", 0.0, 0.9, "share of the drive that friction holds back"),
        Parameter(
            "reach_mm",
            "mm",
            0.0001,
            10.0,
            "travel until the last slider slips",
            neutral=None,
            starts=6,
            logarithmic=True,
        ),
    ),
    needs_times=True,
    memory=True,
    start="deflection of the friction sliders, as a fraction of their reach",
    starts_at_ends=True,
    narrow=narrow,
    demonstrated=True,
    act=act,
)

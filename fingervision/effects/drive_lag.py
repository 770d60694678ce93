"""The mechanism is late behind the recorded input."""

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values
from fingervision.domain.parameter import Parameter


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: the mechanism is late behind the recorded input."""
    out = np.empty_like(input_mm)
    for run in history.runs:
        time_s = history.times[run]
        out[run] = np.interp(time_s - values["delay_s"], time_s, input_mm[run])
    return out


EFFECT = DriveEffect(
    name="drive_lag",
    stage=Stage.DRIVE,
    order=10,
    words="the mechanism is late behind the recorded input",
    formula="u(t - delay_s)",
    source="a pure delay: transport in the controller and the log",
    residual="proportional to the speed; changes sign at a reversal; nothing in holds",
    parameters=(Parameter("delay_s", "s", 0.0, 1.0, "delay", starts=8, logarithmic=True),),
    needs_times=True,
    memory=True,
    act=act,
)

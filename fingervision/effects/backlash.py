"""Backlash: after a reversal of the motion, the output moves only after the play is taken up."""

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values, start_key
from fingervision.domain.parameter import Parameter
from fingervision.effects.play_operator import play


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: after a reversal, the output moves only after the play is taken up."""
    out = np.empty_like(input_mm)
    for index, run in enumerate(history.runs):
        out[run] = play(input_mm[run], values["play_mm"], values.get(start_key(index), 0.0))
    return out


EFFECT = DriveEffect(
    name="backlash",
    stage=Stage.DRIVE,
    order=60,
    words="after a reversal, the mechanism moves only once the play is taken up",
    formula="play operator of full width play_mm; each run starts anywhere within the play",
    source="Prandtl play; Visintin 1994",
    residual="two parallel branches, one for each direction, half the play to either side of the simulation",
    parameters=(Parameter("play_mm", "mm", 0.0, 0.5, "full width of the play", starts=8, logarithmic=True),),
    needs_times=True,
    memory=True,
    start="position within the play, in half widths of the play",
    starts_at_ends=True,
    demonstrated=True,
    act=act,
)

"""Stick-slip: the output sticks and then moves in jumps."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values
from fingervision.domain.loops import filled, loop
from fingervision.domain.parameter import Parameter

_stick = loop("stick_slip_stick")


def stick(input_mm: Array, jump_mm: float) -> Array:
    """Output that stays constant until the input of one run has moved away by more than `jump_mm`; shape (n,)."""
    return filled(_stick, input_mm, jump_mm)


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: the output sticks and then moves in jumps."""
    out = np.empty_like(input_mm)
    for run in history.runs:
        out[run] = stick(input_mm[run], values["jump_mm"])
    return out


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    smallest_mm = max(2.0 * history.input_step_mm, 6.0 * history.input_sigma_mm)
    if smallest_mm >= 0.5:
        return "the recorded input is too noisy to show jumps of less than 0.5 mm"
    (jump,) = EFFECT.parameters
    lowest_mm = max(smallest_mm, 1e-3 * jump.upper)
    # Sizes closer than this move the last jump of a stroke by less than a sample.
    apart = history.resolved_mm / max(history.input_span_mm, 1e-300)
    starts = int(np.clip(np.log(jump.upper / lowest_mm) / max(apart, 1e-300), 8, jump.starts))
    return (replace(jump, lower=smallest_mm, neutral=smallest_mm if smallest_mm > 0.0 else 0.0, starts=starts),)


EFFECT = DriveEffect(
    name="stick_slip",
    stage=Stage.DRIVE,
    order=70,
    words="the stage sticks and moves in jumps",
    formula="if abs(u - s) > jump_mm then s = u, else s stays",
    source="definition: stiction released at a fixed extension",
    residual="a saw-tooth over the input whose teeth are jump_mm wide",
    parameters=(
        Parameter(
            "jump_mm", "mm", 0.0, 0.5, "change of input before a jump", starts=300, logarithmic=True, rugged=True
        ),
    ),
    needs_times=True,
    memory=True,
    narrow=narrow,
    at_frames=True,
    demonstrated=True,
    act=act,
)

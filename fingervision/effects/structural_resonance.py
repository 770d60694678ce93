"""Structural resonance: the structure vibrates after fast motions."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array, History, PointEffect, Stage, Values
from fingervision.domain.loops import filled, loop
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response

_ring = loop("structural_resonance_ring")


def ring(signal: Array, time_s: Array, frequency_hz: float, damping_ratio: float) -> Array:
    """Response of a second-order system to one run's signal, at rest at the first sample; shape (n,).

    The computed response is exact for a signal that is linear between its samples.
    """
    return filled(_ring, signal, np.ascontiguousarray(time_s), frequency_hz, min(damping_ratio, 0.9999))


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the structure vibrates after fast motions."""
    if values["frequency_hz"] == 0.0:  # no resonance given
        return response
    opening_mm = response.gap_mm - history.rest_gap_mm
    out_mm = np.empty_like(opening_mm)
    for run in history.runs:
        out_mm[run] = ring(opening_mm[run], history.times[run], values["frequency_hz"], values["damping_ratio"])
    return response.with_gap(history.rest_gap_mm + out_mm)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    highest_hz = 0.4 / history.sample_time_s
    if highest_hz <= 0.5:
        return f"the sample rate of {1.0 / history.sample_time_s:.3g} Hz is too low to show 0.5 Hz and more"
    frequency, damping = EFFECT.parameters
    return replace(frequency, upper=highest_hz), damping


EFFECT = PointEffect(
    name="structural_resonance",
    stage=Stage.MECHANISM,
    order=120,
    words="the mechanism rings at a natural frequency after fast moves",
    formula="x'' + 2 d w x' + w^2 x = w^2 o, linear input between samples",
    source="linear oscillator, damping to ground",
    residual="a decaying oscillation after each change of speed",
    parameters=(
        Parameter("frequency_hz", "Hz", 0.5, 10000.0, "natural frequency", neutral=None, starts=10, logarithmic=True),
        Parameter(
            "damping_ratio", "", 0.005, 1.0, "share of critical damping", neutral=None, starts=2, logarithmic=True
        ),
    ),
    needs_times=True,
    memory=True,
    narrow=narrow,
    delay_s=lambda values: values["damping_ratio"] / (np.pi * values["frequency_hz"]),
    act=act,
)

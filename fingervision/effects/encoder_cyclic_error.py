"""Cyclic encoder error: a position error that repeats with the period of the encoder's scale."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values
from fingervision.domain.parameter import Parameter

PER_PERIOD = 4.0
"""Rows on each period, so that it is not mistaken for a longer one; also standard uncertainties of the input in each
quarter of a period, so that the phase of every row is known."""
ORDERS = (2, 3, 4, 5, 6, 7)
"""Orders of the harmonics that accompany the first harmonic of a screw or resolver."""


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: add a position error that repeats with the period of the encoder's scale."""
    if values["amplitude_mm"] == 0.0:
        return input_mm
    turns = 2.0 * np.pi * input_mm / values["period_mm"]
    wave = np.sin(turns + values["phase_rad"])
    for order in ORDERS:
        for name, harmonic in (("sin", np.sin), ("cos", np.cos)):
            if f"{name}_{order}" in values:
                wave = wave + values[f"{name}_{order}"] * harmonic(order * turns)
    return input_mm + values["amplitude_mm"] * wave


def inexact(values: Values) -> tuple[Values, ...]:
    """Harmonics, as shares of the first: in a periodic curve without jumps they fall with the square of their order."""
    return tuple({**values, f"{name}_{order}": 1.0 / order**2} for order in ORDERS for name in ("sin", "cos"))


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    shortest_mm = PER_PERIOD * max(history.resolved_mm, PER_PERIOD * history.input_sigma_mm)
    if shortest_mm >= 0.5 * history.input_span_mm:
        return "the steps of the input are too wide to resolve a period of half the input's range or less"
    # Neighbouring starting values of the period differ by half a cycle over the range, so that no period is missed.
    starts = int(np.clip(2.0 * history.input_span_mm / shortest_mm, 8, 300))
    amplitude, period, phase = EFFECT.parameters
    return amplitude, replace(period, lower=shortest_mm, upper=0.5 * history.input_span_mm, starts=starts), phase


EFFECT = DriveEffect(
    name="encoder_cyclic_error",
    stage=Stage.DRIVE,
    order=40,
    words="the encoder has an error that repeats with the period of its scale",
    formula="u + amplitude_mm sin(2 pi u / period_mm + phase_rad)",
    source="interpolation error of incremental encoders (Heydemann 1981)",
    residual="a sinusoid over the input, the same in every run",
    parameters=(
        Parameter("amplitude_mm", "mm", 0.0, 0.2, "amplitude of the cyclic error"),
        Parameter(
            "period_mm", "mm", 0.0001, 10.0, "period of the encoder scale", neutral=None, starts=24, reciprocal=True
        ),
        Parameter("phase_rad", "rad", -3.15, 3.15, "phase of the cyclic error", neutral=None, starts=4),
    ),
    narrow=narrow,
    inexact=inexact,
    wave=("amplitude_mm", "period_mm"),
    demonstrated=True,
    act=act,
)

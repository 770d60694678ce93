"""Thermal drift: a slow symmetric change of the gap over time, independent of the input."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: a slow symmetric change of the gap over time, independent of the input."""
    if values["amplitude_mm"] == 0.0:
        return response
    return response.with_gap(response.gap_mm - values["amplitude_mm"] * np.expm1(-history.clock_s / values["tau_s"]))


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Exclude time constants so short that the drift ends before the second reading and would be a constant offset."""
    amplitude, tau = EFFECT.parameters
    if history.sample_time_s >= tau.upper:
        return f"readings are {history.sample_time_s:.3g} s apart, so that warming would end between two readings"
    return amplitude, replace(tau, lower=max(tau.lower, history.sample_time_s))


EFFECT = PointEffect(
    name="thermal_drift",
    stage=Stage.MECHANISM,
    order=160,
    words="warming changes the gap slowly and symmetrically, whatever the input",
    formula="g + amplitude_mm (1 - exp(-t / tau_s))",
    source="first-order warming",
    residual="an exponential over the time of the whole table, in the gap only",
    parameters=(
        Parameter("amplitude_mm", "mm", -2.0, 2.0, "final thermal change"),
        Parameter("tau_s", "s", 2.0, 3000.0, "thermal time constant", neutral=None, starts=5, logarithmic=True),
    ),
    needs_times=True,
    needs_shared_clock=True,
    demonstrated=True,
    narrow=narrow,
    act=act,
)

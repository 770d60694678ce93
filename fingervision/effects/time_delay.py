"""Time delay of a signal, with linear or curved interpolation between its samples."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from fingervision.domain.effect import Array, DriveEffect, Effect, History, PointEffect
from fingervision.domain.parameter import Parameter

COMMANDED_STARTS = 60
"""Number of delays that are tried with step commands; each is an eighth longer than the preceding delay."""
FEWEST = 4
"""Smallest number of samples in a run for curved interpolation."""


def is_delay(effect: Effect) -> bool:
    """Whether an effect is a delay, with `delay_s` as its only parameter."""
    return isinstance(effect, DriveEffect | PointEffect) and effect.act_curved is not None


def late(signal: Array, history: History, delay_s: float, *, curved: bool = False) -> Array:
    """Delay a signal by a given time; before the start of a run, the signal is assumed to be constant.

    Parameters
    ----------
    signal : ndarray of float, shape (n,)
        One value per sample.
    history : History
        Runs and times.
    delay_s : float
        Delay by which the returned signal is late.
    curved : bool
        Whether the signal is interpolated between its samples along a curve (Akima 1970, which preserves corners) or
        linearly.

    Returns
    -------
    ndarray of float, shape (n,)
    """
    out = np.empty_like(signal)
    for run in history.runs:
        time_s, own = history.times[run], signal[run]
        ago_s = np.maximum(time_s - delay_s, time_s[0])
        if curved and own.size >= FEWEST:
            out[run] = Akima1DInterpolator(time_s, own)(ago_s)
        else:
            out[run] = np.interp(ago_s, time_s, own)
    return out


def delay_that_shows(history: History, delay: Parameter) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of a delay to what the data can show; delays shorter than the stage's rests are invisible.

    With step commands, the prediction jumps as a function of the delay, whenever the delay passes a sample time.
    """
    if history.dwell_s <= delay.upper:
        return (replace(delay, rugged=True, starts=COMMANDED_STARTS) if history.commanded else delay,)
    return (
        f"the stage is assumed to have rested for {history.dwell_s:.3g} s or longer before each reading, and a delay "
        f"of at most {delay.upper:g} s is over by then"
    )

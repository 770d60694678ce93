"""Delay of a signal by a time, interpolated along straight lines or a curve between its samples."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from fingervision.domain.effect import Array, History
from fingervision.domain.parameter import Parameter

COMMANDED_STARTS = 60
"""Delays that are tried under step commands: each an eighth longer than the one before, which a scan spans."""
FEWEST = 4
"""Samples of a run that draw a curve."""


def late(signal: Array, history: History, delay_s: float, *, curved: bool = False) -> Array:
    """Delay a signal; before its run's start it is taken as constant.

    Parameters
    ----------
    signal : ndarray of float, shape (n,)
        One value a sample.
    history : History
        Runs and times.
    delay_s : float
        How long ago.
    curved : bool
        Whether it went along a curve between its samples (Akima 1970, which keeps corners), or along straight lines.

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
    """Bound a delay by what the data can show; none is visible where the stage stood still longer than the delay.

    Under step commands the prediction changes in jumps when the delay passes from one sample to the next.
    """
    if history.dwell_s <= delay.upper:
        return (replace(delay, rugged=True, starts=COMMANDED_STARTS) if history.commanded else delay,)
    return (
        f"the stage is taken to have stood for {history.dwell_s:.3g} s or longer before each reading, "
        f"and a delay of at most {delay.upper:g} s is over by then"
    )

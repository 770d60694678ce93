"""A signal some time ago."""

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from fingervision.domain.effect import Array, History

LONGEST_S = 1.0
"""Longest delay of the catalogue."""
FEWEST = 4
"""Samples of a run that draw a curve."""


def late(signal: Array, history: History, delay_s: float, *, curved: bool = False) -> Array:
    """Delay a signal; before a run's start it was as at its first sample.

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


def over_before_reading(history: History) -> str | None:
    """Say why no delay can show: every reading was taken when it was over; None where it can."""
    if history.dwell_s <= LONGEST_S:
        return None
    return (
        f"the stage is taken to have stood for {history.dwell_s:.3g} s or longer before each reading, "
        f"and a delay of at most {LONGEST_S:g} s is over by then"
    )

"""Error of a clock offset that was estimated from the same motion, as a random effect."""

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import Array

FREEDOM = 3.0
"""Factor on the offset's uncertainty for its prior when it is refitted. The offset was found from these same data, so
that its uncertainty is not independent knowledge: with 3 u the prior adds a ninth of the data's information, whereas
with u the data would count twice, and the uncertainty of a play that is correlated with the offset would be
understated."""


def clock_columns(chain: MeasuringChain, u_clock_s: float) -> Array:
    """Change of the stacked prediction per standard deviation of the clock offset's prior; shape (m, 1), or (m, 0).

    Parameters
    ----------
    chain : MeasuringChain
        Model with the recorded input.
    u_clock_s : float
        Standard uncertainty of the offset; 0 if both have the same clock.
    """
    history = chain.history
    if u_clock_s == 0.0 or history.time_s is None:
        return np.zeros((chain.stacked({}).size, 0))
    # Step of the difference: the offset's uncertainty, but at most half a sample, over which the record is straight.
    step_s = min(u_clock_s, 0.5 * history.sample_time_s)
    ends = [chain.with_input(_moved(chain, by_s)).stacked({}) for by_s in (-step_s, step_s)]
    return np.asarray((ends[1] - ends[0]) * (FREEDOM * u_clock_s / (2.0 * step_s)))[:, None]


def _moved(chain: MeasuringChain, by_s: float) -> Array:
    """Delay the recorded input by `by_s`, run by run."""
    history = chain.history
    out = np.empty_like(history.input_mm)
    for run in history.runs:
        time_s = history.times[run]
        out[run] = np.interp(time_s + by_s, time_s, history.input_mm[run])
    return out

"""Leaps of a clock that are no time that passed: summer time, and counters that run over."""

import numpy as np
from numpy.typing import NDArray

HOUR_S = 3600.0
COUNTER_BITS = (16, 24, 31, 32)
COUNTS_S = (1.0, 1e-3, 1e-6)
"""What one count of a clock may be worth (s)."""
OVERFLOWS_S = np.array([2.0**bits * count for bits in COUNTER_BITS for count in COUNTS_S])
PERIODS_S = np.concatenate([[HOUR_S], OVERFLOWS_S])
MOST_STEPS = 3.0
"""Largest difference between a leap and its cause, in usual steps: a step may be lost or late beside it."""


def usual_step(time: NDArray[np.float64]) -> float:
    """Median time between two rows."""
    return float(np.median(np.abs(np.diff(time))))


def _period(step: NDArray[np.float64], usual: float) -> NDArray[np.float64]:
    """For each step, what summer time or an overflow added to it, with its sign; 0 if neither explains it."""
    if not 0.0 < usual < HOUR_S / (2.0 * MOST_STEPS):
        return np.zeros(step.size)
    signed = np.concatenate([PERIODS_S[:1], -PERIODS_S])
    apart = np.abs(step[:, None] - signed - usual)
    best = np.argmin(apart, axis=1)
    return np.where(apart[np.arange(step.size), best] <= MOST_STEPS * usual, signed[best], 0.0)


def is_known_leap(step: NDArray[np.float64], time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether summer time or the overflow of a counter explains each of some steps of a time."""
    return np.asarray(_period(step, usual_step(time)) != 0.0)


def clock_leaps(time: NDArray[np.float64], *, dated: bool) -> NDArray[np.intp]:
    """Steps of a clock that go back, and those by an hour more than usual, if times are dates.

    Parameters
    ----------
    time : ndarray of float, shape (n,)
        Times (s).
    dated : bool
        Whether the times were written as dates: only such clocks are put forward.
    """
    steps = np.diff(time)
    far = np.flatnonzero((steps < 0.0) | ((steps > 0.5 * HOUR_S) & dated))
    return far[(steps[far] < 0.0) | is_known_leap(steps[far], time)]


def without_leaps(time: NDArray[np.float64], leaps: NDArray[np.intp]) -> NDArray[np.float64]:
    """Elapsed time of a clock whose steps at some places are leaps.

    What is known to cause a leap is taken away; any other leap is replaced by the usual step.
    """
    usual = usual_step(time)
    steps = np.diff(time)
    cause = _period(steps[leaps], usual)
    steps[leaps] = np.where(cause != 0.0, steps[leaps] - cause, usual)
    return np.concatenate([[0.0], np.cumsum(steps)])

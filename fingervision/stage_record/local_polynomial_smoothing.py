"""Smoothing of the recorded input: local lines and parabolas, over windows as wide as the record allows."""

import numpy as np

from fingervision.domain.effect import Array
from fingervision.domain.loops import loop

LINES = (241, 121, 61, 41, 27, 19, 13, 9, 7, 5)
PARABOLAS = (121, 61, 41, 27, 19, 13, 9, 7)
"""Samples of the windows that are tried; a stage that swings runs straight for too few of them."""
PLACES = 5
"""Places of a sample in its window, from one end to the other."""
CHI_SIGMAS, END_SIGMAS, TREND_SIGMAS = 2.5, 3.0, 1.0
"""Limits on a window's rest: in all, at its ends, and along the next higher power, which would bend unseen."""
CHOSEN = 1.4
"""By how much the parabola that looks best is worse than it looks: errors over claims of sines with noise."""
CURVED_SIGMAS = 2.0
"""Above which a parabola's curvature counts against a straight line."""

_smooth = loop("local_polynomial_smoothing_run")


def smoothed(
    input_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float, step_mm: float
) -> tuple[Array, Array]:
    """Smooth the record within its runs.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (n,)
        The record.
    runs : tuple of slice
        Samples of each run.
    sigma_mm, step_mm : float
        As `input_noise.input_sigma` gives them.

    Returns
    -------
    input_mm, leverage : ndarray of float, shape (n,)
        The remaining variance of each value is `leverage * sigma_mm**2`; 1 where nothing passed.
    """
    out, leverage = input_mm.copy(), np.ones_like(input_mm)
    for run in runs:
        if run.stop - run.start >= 5:
            time, values = (np.ascontiguousarray(a[run], dtype=np.float64) for a in (time_s, input_mm))
            smooth, weight = np.empty_like(values), np.empty_like(values)
            _smooth(time, values, sigma_mm, bool(step_mm > 0.0), np.array(LINES), np.array(PARABOLAS), smooth, weight)
            out[run], leverage[run] = smooth, weight
    return out, leverage

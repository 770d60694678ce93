"""Smooth the recorded input by local straight lines and parabolas, in windows as long as the motion allows."""

import numpy as np

from fingervision.domain.effect import Array
from fingervision.domain.loops import loop

LINES = (241, 121, 61, 41, 27, 19, 13, 9, 7, 5)
PARABOLAS = (121, 61, 41, 27, 19, 13, 9, 7)
"""Window lengths tried for parabolas, in samples; for an oscillating stage the motion is straight over too few
samples."""
PLACES = 5
"""Number of positions of a sample within its window that are tried, from one end to the other."""
CHI_SIGMAS, END_SIGMAS, TREND_SIGMAS = 2.5, 3.0, 1.0
"""Limits on a window's residuals in standard uncertainties: chi-square in all, residuals at the ends, and the trend of
the next higher power, which would otherwise bias the fit unnoticed."""
CHOSEN = 1.4
"""Factor by which the error of the selected parabola exceeds its stated error, because the best-looking one is selected
(from simulated sines with noise)."""
CURVED_SIGMAS = 2.0
"""Significance, in standard uncertainties, of a parabola's curvature above which a straight line is rejected."""

_smooth = loop("local_polynomial_smoothing_run")


def smoothed(
    input_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float, step_mm: float
) -> tuple[Array, Array]:
    """Smooth the record separately within each run.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (n,)
        The record.
    runs : tuple of slice
        Samples of each run.
    sigma_mm, step_mm : float
        Results of `encoder.input_sigma`.

    Returns
    -------
    input_mm, leverage : ndarray of float, shape (n,)
        Smoothed values, and the remaining variance of each value divided by `sigma_mm**2`; the leverage is 1 for a
        value that was not smoothed.
    """
    out, leverage = input_mm.copy(), np.ones_like(input_mm)
    for run in runs:
        if run.stop - run.start >= 5:
            time, values = (np.ascontiguousarray(a[run], dtype=np.float64) for a in (time_s, input_mm))
            smooth, weight = np.empty_like(values), np.empty_like(values)
            _smooth(time, values, sigma_mm, bool(step_mm > 0.0), np.array(LINES), np.array(PARABOLAS), smooth, weight)
            out[run], leverage[run] = smooth, weight
    return out, leverage

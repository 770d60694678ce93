"""Blend values smoothed in neighbouring windows, which differ because each sample has selected its own window."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array

BLENDED, RETURNED = 0.35, 1.0
"""Half widths of the triangular weights, as shares of a sample's effective window (the inverse of its leverage), for
the smoothed values and for what the record lies off them on average.

Drawn encoder records without effects (`tests.benchmarks.world.rows.encoder_jitter`, seeds 7 and 811, 25 each): the
differences of the error from sample to sample fall from 0.28 to 0.22 standard uncertainties of one recorded value. The
error falls from 0.50 to 0.48, and the mean shrinkage of the strokes from 0.07 to 0.035 encoder steps. Without the
second average of each kind the strokes shrink by 0.11 steps, and swings by as much as their noise."""


def blended(smooth_mm: Array, recorded_mm: Array, time_s: Array, runs: tuple[slice, ...], leverage: Array) -> Array:
    """Average smoothed values over a part of their windows, and return to them what the record lies off on average.

    The windows of neighbouring samples differ, and with them the errors of the smoothed values: they zigzag by a tenth
    of an encoder step. An effect that averages neighbouring samples, such as a lag by part of a sample, would seem to
    explain this zigzag (68 in chi-square for a lag of 10 ms in a table without one). Averages cut turns short, and so
    do windows that were just straight enough, which looks like a scale: what an average takes away is averaged and
    returned (twicing; Tukey 1977).

    Parameters
    ----------
    smooth_mm, recorded_mm, time_s : ndarray of float, shape (n,)
        Smoothed and recorded input, and times.
    runs : tuple of slice
        Samples of each run.
    leverage : ndarray of float, shape (n,)
        Leverage of each smoothed value, from `local_polynomial_smoothing.smoothed`.

    Returns
    -------
    ndarray of float, shape (n,)
        The input; a motion at constant speed stays as it is.
    """
    out = smooth_mm.copy()
    for run in runs:
        time, window = time_s[run], 1.0 / leverage[run]
        once = _averaged(smooth_mm[run], time, BLENDED * window)
        even = 2.0 * once - _averaged(once, time, BLENDED * window)
        out[run] = even + _averaged(recorded_mm[run] - even, time, RETURNED * window)
    return out


def _averaged(values: Array, time_s: Array, half_widths: Array) -> Array:
    """Average values with triangular weights of given half widths in samples, narrower at the ends; shape (n,)."""
    out = values.copy()
    place = np.arange(values.size)
    reach: NDArray[np.intp] = np.minimum(half_widths.astype(np.intp), np.minimum(place, values.size - 1 - place))
    for half in np.unique(reach[reach > 0]).tolist():
        at = np.flatnonzero(reach == half)
        weights = 1.0 - np.abs(np.arange(-half, half + 1)) / (half + 1.0)
        weights /= weights.sum()
        around = at[:, None] + np.arange(-half, half + 1)
        # The weighted mean time of uneven samples is not that of the sample.
        late_s = time_s[around] @ weights - time_s[at]
        speed = (values[at + half] - values[at - half]) / (time_s[at + half] - time_s[at - half])
        out[at] = values[around] @ weights - speed * late_s
    return out

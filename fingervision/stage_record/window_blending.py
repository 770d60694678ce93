"""Blend values smoothed in neighbouring windows, which differ because each sample has selected its own window."""

import numpy as np

from fingervision.domain.effect import Array

REACH = 0.35
"""Half width of the triangular weights, as a share of a sample's effective window (the inverse of its leverage).

In drawn encoder records (`tests.benchmarks.world`, rows encoder_jitter and encoder_bar, seed 7) it lowers the
differences of the error from sample to sample by a third, and leaves the error itself as it was (0.25 and 0.35); 0.5
rounds corners by more than it gains."""


def blended(smooth_mm: Array, time_s: Array, runs: tuple[slice, ...], leverage: Array) -> Array:
    """Average smoothed values over a part of their windows, with triangular weights; shape (n,) (mm).

    The windows of neighbouring samples differ, and with them the errors of the smoothed values: they zigzag by a tenth
    of an encoder step. An effect that averages neighbouring samples, such as a lag by part of a sample, would seem to
    explain this zigzag (68 in chi-square for a lag of 10 ms in a table without one). Over a part of a window the motion
    is straight, or the window would not have been selected, so that the average keeps the motion.

    Parameters
    ----------
    smooth_mm, time_s : ndarray of float, shape (n,)
        Smoothed input and times.
    runs : tuple of slice
        Samples of each run.
    leverage : ndarray of float, shape (n,)
        Leverage of each smoothed value, from `local_polynomial_smoothing.smoothed`.
    """
    out = smooth_mm.copy()
    for run in runs:
        values, time = smooth_mm[run], time_s[run]
        place = np.arange(values.size)
        room = np.minimum(place, values.size - 1 - place)
        reach = np.minimum((REACH / leverage[run]).astype(np.intp), room)
        for half in np.unique(reach[reach > 0]).tolist():
            at = np.flatnonzero(reach == half)
            weights = 1.0 - np.abs(np.arange(-half, half + 1)) / (half + 1.0)
            weights /= weights.sum()
            around = at[:, None] + np.arange(-half, half + 1)
            # If samples are not equidistant, their weighted mean time differs from the time of the sample.
            late_s = time[around] @ weights - time[at]
            speed = (values[at + half] - values[at - half]) / (time[at + half] - time[at - half])
            out[run][at] = values[around] @ weights - speed * late_s
    return out

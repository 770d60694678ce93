"""Upper bound of the noise in a residual: slow changes are structure, or indistinguishable from structure."""

import numpy as np

from fingervision.domain.effect import Array

CORRELATED = 10.0
"""Largest ratio of noise to its scatter from sample to sample: for an autoregression of 0.95 it is six."""
STRETCH = 20
"""Length, in samples, of stretches in which noise must be visible."""
WANDERING = 1.65
"""Largest ratio of noise to its scatter within such stretches: that of an autoregression of 0.9 (simulated; 1.3 for
0.8). With only the limit on the scatter from sample to sample, a third of a creep counted as noise."""


def most_noise(residual_mm: Array, runs: tuple[slice, ...], digits_mm: float) -> float:
    """Largest standard deviation that the noise of a residual may have (mm); 0 if the runs are too short.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Residual of an explanation.
    runs : tuple of slice
        Rows of each run.
    digits_mm : float
        Standard deviation of the rounding of a reading.
    """
    limits = ((CORRELATED, _short_scatter(residual_mm, runs)), (WANDERING, _local_scatter(residual_mm, runs)))
    return min((times * max(scatter, digits_mm) for times, scatter in limits if scatter or digits_mm), default=0.0)


def _short_scatter(residual_mm: Array, runs: tuple[slice, ...]) -> float:
    """Standard deviation of white noise with the same median third difference; 0 for runs of a few samples."""
    differences = np.concatenate([np.diff(residual_mm[run], 3) for run in runs])
    # Third differences of white noise have 1 + 9 + 9 + 1 times its variance; 0.6745 is the normal median.
    return float(np.median(np.abs(differences))) / 0.6745 / float(np.sqrt(20.0)) if differences.size else 0.0


def _local_scatter(residual_mm: Array, runs: tuple[slice, ...]) -> float:
    """Median standard deviation within stretches, each about its own mean; 0 without stretches.

    The median is used because an unexplained resonance or jump is large in a few stretches only.
    """
    found = []
    for run in runs:
        size = min(STRETCH, run.stop - run.start)
        if size > 1:
            begins = range(run.start, run.stop - size + 1, max(1, size // 2))
            found += [float(np.std(residual_mm[begin : begin + size], ddof=1)) for begin in begins]
    return float(np.median(found)) if found else 0.0

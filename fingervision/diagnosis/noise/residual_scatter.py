"""Upper bound of the noise in a residual: slow changes, and changes that every pass repeats, are structure."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array

CORRELATED = 10.0
"""Largest ratio of noise to its scatter from sample to sample: for an autoregression of 0.95 it is six."""
STRETCH = 20
"""Length, in samples, of stretches in which noise must be visible."""
WANDERING = 1.65
"""Largest ratio of noise to its scatter within such stretches: that of an autoregression of 0.9 (simulated; 1.3 for
0.8). With only the limit on the scatter from sample to sample, a third of a creep counted as noise."""
FEWEST_PAIRS = 20
"""Least number of readings with a second pass over their position: their scatter then has a relative uncertainty of a
sixth."""


def most_noise(residual_mm: Array, input_mm: Array, runs: tuple[slice, ...], digits_mm: float) -> float:
    """Largest standard deviation that the noise of a residual may have (mm); 0 if the runs are too short.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Residual of an explanation.
    input_mm : ndarray of float, shape (n,)
        Recorded input.
    runs : tuple of slice
        Rows of each run.
    digits_mm : float
        Standard deviation of the rounding of a reading.
    """
    limits = (
        (CORRELATED, _short_scatter(residual_mm, runs)),
        (WANDERING, _local_scatter(residual_mm, runs)),
        (1.0, _scatter_between_passes(residual_mm, input_mm, runs)),
    )
    return min((times * max(scatter, digits_mm) for times, scatter in limits if scatter is not None), default=0.0)


def _scatter_between_passes(residual_mm: Array, input_mm: Array, runs: tuple[slice, ...]) -> float | None:
    """Standard deviation of a reading, from differences of successive passes over a position; None without passes.

    A rough map of position errors looks like noise over time, but the return motion repeats it; stick-slip and other
    errors that depend on the direction are repeated by the next pass in the same direction. The smaller scatter is
    used. The mean difference of two passes may be hysteresis or drift and is removed. A value that is interpolated
    between two readings has at least half the variance of one reading, so that the result is not too small for noise
    that is independent between the passes.
    """
    ways = [[part + run.start for part in _passes(input_mm[run])] for run in runs]
    returns = [pair for one in ways for pair in pairwise(one)]
    same_way = [pair for one in ways for pair in zip(one, one[2:], strict=False)]
    found = [_scatter_of_pairs(residual_mm, input_mm, pairs) for pairs in (returns, same_way)]
    return min((scatter for scatter in found if scatter is not None), default=None)


def _scatter_of_pairs(
    residual_mm: Array, input_mm: Array, pairs: list[tuple[NDArray[np.int64], NDArray[np.int64]]]
) -> float | None:
    """Standard deviation of a reading from the differences of pairs of passes; None if the pairs share few readings."""
    found = []
    for there, back in pairs:
        if there.size and back.size:
            order = np.argsort(input_mm[back])
            low, high = input_mm[back[order[0]]], input_mm[back[order[-1]]]
            within = there[(input_mm[there] >= low) & (input_mm[there] <= high)]
            if within.size > 1:
                beside = np.interp(input_mm[within], input_mm[back[order]], residual_mm[back[order]])
                apart = residual_mm[within] - beside
                found.append(np.abs(apart - np.median(apart)))
    differences = np.concatenate(found) if found else np.zeros(0)
    # 0.6745 is the median of |x| for a normal distribution; a bump in a single pass enlarges only few differences.
    return float(np.median(differences) / 0.6745 / np.sqrt(1.5)) if differences.size >= FEWEST_PAIRS else None


def _passes(input_mm: Array) -> list[NDArray[np.int64]]:
    """Indices of the samples of each stretch over which the input moves in one direction, without its holds."""
    step = np.sign(np.diff(input_mm))
    moving = np.flatnonzero(step)
    turns = np.flatnonzero(np.diff(step[moving])) + 1
    return [part + 1 for part in np.split(moving, turns) if part.size > 1]


def _short_scatter(residual_mm: Array, runs: tuple[slice, ...]) -> float | None:
    """Standard deviation of white noise with the same median third difference; None for runs of a few samples."""
    differences = np.concatenate([np.diff(residual_mm[run], 3) for run in runs])
    # Third differences of white noise have 1 + 9 + 9 + 1 times its variance; 0.6745 is the median of |x| for a normal
    # distribution.
    return float(np.median(np.abs(differences))) / 0.6745 / float(np.sqrt(20.0)) if differences.size else None


def _local_scatter(residual_mm: Array, runs: tuple[slice, ...]) -> float | None:
    """Median standard deviation within stretches, each about its own mean; None without stretches.

    The median is used because an unexplained resonance or jump is large in a few stretches only.
    """
    found = []
    for run in runs:
        size = min(STRETCH, run.stop - run.start)
        if size > 1:
            begins = range(run.start, run.stop - size + 1, max(1, size // 2))
            found += [float(np.std(residual_mm[begin : begin + size], ddof=1)) for begin in begins]
    return float(np.median(found)) if found else None

"""Noise of the recorded input, and the step of its encoder, estimated from the record itself."""

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.effect import Array

# Differences of a record along its own times, in which a smooth motion vanishes even where rows are uneven.

EVEN = 1e-6
"""Relative spread of the time steps below which the steps are equal within the digits of the file."""


def differences(values: Array, time_s: Array, order: int) -> Array:
    """Take differences of a given order of a record: zero for every polynomial in time of a lower degree.

    These are divided differences (Newton), scaled to the noise gain of ordinary differences, binom(2k, k)^(1/2). With
    equal steps they are equal to ordinary differences. For rows that are missing or late, ordinary differences would
    contain speed times delay.

    Parameters
    ----------
    values, time_s : ndarray of float, shape (n,)
        Record of one run; times increase.
    order : int
        1 or more.

    Returns
    -------
    ndarray of float, shape (n - order,), or (0,)
    """
    count = values.size - order
    if count <= 0:
        return np.zeros(0)
    steps = np.diff(time_s)
    if float(np.ptp(steps)) <= EVEN * float(steps.mean()):
        return np.asarray(np.diff(values, order))
    weights = np.ones((order + 1, count))
    for j in range(order + 1):
        for i in range(order + 1):
            if i != j:
                weights[j] *= steps.mean() / (time_s[j : j + count] - time_s[i : i + count])
    weights *= np.sqrt(comb(2 * order, order) / np.sum(weights**2, axis=0))
    return np.asarray(np.sum([weights[j] * values[j : j + count] for j in range(order + 1)], axis=0))


RESOLVED_MM = 1e-7
"""Differences of recorded inputs below this value are rounding in the file's last digits."""
ORDERS = (3, 4, 5, 6)
"""Orders of the differences: 3 is the lowest for which a stroke at one speed vanishes, including its acceleration."""
MANY = 100
"""Number of samples below which only one estimate is used: the smallest of several scattering ones would be too
small."""
NORMAL_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal variable."""
LINE = 9
"""Number of samples in the straight lines about which the scatter of a record on a grid is computed."""
ROUNDED = 1.5
"""Ratio of the scatter to that of rounding above which the record contains noise as well."""
HALTING = 0.5
"""Ratio of the number of speed changes by a single step to the number of moving samples: a slow motion halts between an
encoder's steps."""
CLUSTERED = 0.5
"""Length of the mean unit vector, with all values placed on a circle of one encoder step, above which the values
cluster at the encoder's lines: for normal jitter of sigma it is exp(-2 (pi sigma / step)^2), 0.5 at a jitter of 0.19
steps."""
EXACT = 1.0 - 1e-6
"""Length of the mean unit vector above which there is no jitter to be removed."""
ON_LINE, EXACT_SHARE = 1e-3, 0.2
"""Distance, as a share of a step, within which a value lies exactly on a line, and share of such values above which the
deviations are not jitter."""
BETWEEN = 0.4
"""Distance from the lines, in steps, that jitter seldom exceeds; of values that are unrelated to lines, a fifth lies
beyond this distance."""
FEWEST_LINES = 8
"""Least number of lines that a record must cross for their spacing to be determined."""
BEYOND_CHANCE = 4.0
"""Ratio of the mean vector's length to that expected by chance at any of the tried steps."""
PEAK_STEP = 0.2
"""Step of the tried frequencies, relative to the inverse of the range: a peak has a width of one."""
MOST_LINES = 400
"""Largest number of lines over the range: finer lines are no finer than the noise of other records."""
MOST_EQUAL = 0.8
"""Share of the changes that advance by the same number of lines, above which the apparent lines are a steady motion. If
the record comes from an encoder that moves by nearly a whole number of lines per row, this error only leaves the jitter
in the record."""
PAUSING = 0.02
"""Ratio of the number of pauses of a single row, within a motion by single steps, to the number of moving samples,
above which the values were rounded: a motion at 0.98 steps per row pauses once in 50. Set points in equal steps pause
at their ends only."""
OTHER_SPEED = 0.25
"""Change of an increment, in grid steps, beyond that due to unequal time steps, above which the speed changed: rounding
changes an increment by a whole step or, between unequal time steps, by any part of it."""
FEWEST_SINGLE = 3
"""Least number of single steps that distinguish an encoder from set points in round numbers."""


def input_sigma(input_mm: Array, runs: tuple[slice, ...], time_s: Array | None = None) -> tuple[float, float]:
    """Estimate the standard uncertainty of one recorded input, and the encoder's step, from the record itself.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Recorded input.
    runs : tuple of slice
        Samples of each run.
    time_s : ndarray of float, shape (n,), or None
        Times of the samples, increasing within each run; None for equal time steps.

    Returns
    -------
    sigma_mm, step_mm : float
        Standard uncertainty of one value, and the encoder's step; the step is 0 if the values do not lie on a grid.

    Notes
    -----
    High-order differences of a smooth motion vanish, so that only noise remains. For a straight motion a low order of
    the differences is sufficient, for an oscillation a higher order is needed; the smallest estimate over all orders is
    used. The median of the differences is robust against reversals.
    """
    orders = ORDERS if input_mm.size >= MANY else ORDERS[:1]
    times = np.arange(float(input_mm.size)) if time_s is None else time_s
    sigma = min(_sigma_by_differences(input_mm, times, runs, order) for order in orders)
    step = _grid(input_mm)
    # Rounding that is finer than the noise needs no encoder step: it averages out with the noise.
    if step < sigma or not _rounds(input_mm, times, runs, step):
        step = 0.0
    if step > 0.0:
        # Alternating rounding has large third differences, whereas a curved motion scatters about straight lines.
        sigma, rounding = min(sigma, _scatter(input_mm, runs)), step / float(np.sqrt(12.0))
        sigma = sigma if sigma > ROUNDED * rounding else rounding
    return (sigma if 1e-7 * np.ptp(input_mm) < sigma < np.inf else 0.0), step


def on_lines(input_mm: Array, runs: tuple[slice, ...]) -> Array:
    """Remove the jitter from an encoder's record: replace each value by the nearest line of the encoder.

    Offset and spacing of the lines are estimated: the spacing is the inverse of the lowest frequency at which the
    characteristic function of the values has a significant peak. A record is returned unchanged if its values do not
    cluster at lines, or lie exactly on them.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Recorded input.
    runs : tuple of slice
        Samples of each run.
    """
    moved = [run.start + np.flatnonzero(np.abs(np.diff(input_mm[run], prepend=np.inf)) > RESOLVED_MM) for run in runs]
    values = input_mm[np.concatenate(moved)]
    span = float(np.ptp(values))
    # A record that is on the lines of its encoder has no jitter: halts at equal distances would be taken for its lines.
    if values.size < MANY or span == 0.0 or input_sigma(input_mm, runs)[1] > 0.0:
        return input_mm
    finest = np.median(np.abs(np.diff(np.sort(values)))) * 4.0
    frequency = np.arange(FEWEST_LINES, min(span / max(finest, RESOLVED_MM), MOST_LINES), PEAK_STEP) / span
    length = np.abs(_characteristic(values, frequency))
    peaks = np.flatnonzero(length > max(CLUSTERED, BEYOND_CHANCE / np.sqrt(values.size)))
    if not peaks.size:
        return input_mm
    first = peaks[0]
    while first + 1 < length.size and length[first + 1] > length[first]:
        first += 1
    around = np.linspace(frequency[first] - PEAK_STEP / span, frequency[first] + PEAK_STEP / span, 201)
    peak = _characteristic(values, around)
    best = int(np.argmax(np.abs(peak)))
    if np.abs(peak[best]) > EXACT:
        return input_mm
    step, shift = 1.0 / around[best], float(np.angle(peak[best])) / (2.0 * np.pi)
    snapped = np.asarray((np.round(input_mm / step - shift) + shift) * step)
    if _equal_steps(input_mm, snapped, runs, step):
        return input_mm
    jitter = np.abs(values - (np.round(values / step - shift) + shift) * step) / step
    sigma = float(np.sqrt(-2.0 * np.log(np.abs(peak[best])))) / (2.0 * np.pi)
    between = 2.0 * float(ndtr(-BETWEEN / sigma))
    # A motion in equal steps lies exactly on lines, and values between the lines are then not jitter.
    if np.mean(jitter < ON_LINE) > EXACT_SHARE or np.mean(jitter > BETWEEN) > 1.5 * between + 0.005:
        return input_mm
    return snapped


def _equal_steps(input_mm: Array, snapped_mm: Array, runs: tuple[slice, ...], step_mm: float) -> bool:
    """Whether values cluster only because the stage moves by the same number of encoder lines from row to row.

    For the true lines of an encoder, most changes of the value are jitter about one line, or the number of lines
    crossed from row to row varies by one.
    """
    crossed = []
    for run in runs:
        changed = np.abs(np.diff(input_mm[run])) > RESOLVED_MM
        crossed.append(np.round(np.abs(np.diff(snapped_mm[run]))[changed] / step_mm))
    count = np.bincount(np.concatenate(crossed).astype(int))
    return bool(count.size > 1 and count[1:].max() > MOST_EQUAL * count.sum())


def _characteristic(values: Array, frequency: Array) -> NDArray[np.complex128]:
    """Characteristic function of the values, mean of exp(2 pi i f x), at evenly spaced frequencies; same shape.

    With f = a + b, the sum over x of exp(2 pi i a x) exp(2 pi i b x) is a product of two matrices: for k frequencies
    it takes 2 sqrt(k) exponentials of every value instead of k.
    """
    block = int(np.ceil(np.sqrt(frequency.size)))
    if block < 2:
        return np.asarray(np.mean(np.exp(2j * np.pi * frequency[:, None] * values), axis=1))
    fine = np.arange(block) * (frequency[1] - frequency[0])
    coarse = frequency[::block]
    first, then = (np.exp(2j * np.pi * part[:, None] * values) for part in (coarse, fine))
    return np.asarray((first @ then.T).ravel()[: frequency.size] / values.size)


def _sigma_by_differences(input_mm: Array, time_s: Array, runs: tuple[slice, ...], order: int) -> float:
    taken = np.concatenate([differences(input_mm[run], time_s[run], order) for run in runs])
    gain = float(np.sqrt(comb(2 * order, order)))
    return float(np.median(np.abs(taken))) / NORMAL_MEDIAN / gain if taken.size else np.inf


def _scatter(input_mm: Array, runs: tuple[slice, ...]) -> float:
    """Median standard deviation about straight lines through `LINE` samples; 0 if no run has so many samples."""
    x = np.arange(LINE) - 0.5 * (LINE - 1)
    found = [np.zeros(0)]
    for run in runs:
        if run.stop - run.start >= LINE:
            windows = np.lib.stride_tricks.sliding_window_view(input_mm[run], LINE)
            rest = windows - windows.mean(axis=1, keepdims=True) - (windows @ x)[:, None] * x / (x @ x)
            found.append(np.sum(rest**2, axis=1) / (LINE - 2))
    variances = np.concatenate(found)
    return float(np.sqrt(np.median(variances))) if variances.size else 0.0


def _grid(input_mm: Array) -> float:
    """Spacing of a grid on which all values lie; 0 if there is none."""
    steps = np.diff(np.unique(np.round(input_mm, 9)))
    # If every sample is several lines ahead of the sample before, the increments differ by single lines.
    lines = np.concatenate([steps, np.diff(np.unique(steps))])
    lines = lines[lines > RESOLVED_MM]
    step = float(np.min(lines, initial=np.inf))
    return step if np.all(np.abs(steps / step - np.round(steps / step)) < 0.02) and lines.size else 0.0


def _rounds(input_mm: Array, time_s: Array, runs: tuple[slice, ...], step_mm: float) -> bool:
    """Whether a motion was rounded to a grid: it pauses on grid values, or its increments differ by single grid steps.

    At a little less than one step per row, nearly all rows advance by one step, and only pauses reveal the grid.
    Increments that differ because rows are missing between them, at one speed, do not reveal a grid.

    Set points in round numbers lie on a grid as well, but advance in equal steps.
    """
    if step_mm == 0.0:
        return False
    fast, halting, paused, moved = 0, 0, 0, 0
    for run in runs:
        taken, lasting = np.diff(input_mm[run]) / step_mm, np.diff(time_s[run])
        moves = np.abs(taken)
        faster = np.abs(taken[1:] - taken[:-1] * lasting[1:] / lasting[:-1]) > OTHER_SPEED
        single = (np.abs(np.abs(np.diff(taken)) - 1.0) < 0.1) & faster
        several = moves[1:] > 1.5
        fast += int(np.sum(single & several))
        halting += int(np.sum(single & ~several))
        way = np.sign(np.diff(input_mm[run])) * (np.abs(moves - 1.0) < 0.1)
        paused += int(np.sum((way[:-2] * way[2:] > 0.0) & (moves[1:-1] < 0.5)))
        moved += int(np.sum(moves > 0.5))
    return (
        fast >= FEWEST_SINGLE
        or halting >= max(FEWEST_SINGLE, HALTING * moved)
        or paused >= max(FEWEST_SINGLE, PAUSING * moved)
    )

"""The input's own error: local straight lines through the record, as wide as the record allows."""

import numpy as np

from fingervision.domain.compiled import compiled_as_written
from fingervision.domain.effect import Array

WINDOWS = (241, 121, 61, 41, 27, 19, 13, 9, 7, 5)


def input_sigma(input_mm: Array, runs: tuple[slice, ...]) -> tuple[float, float]:
    """Estimate the standard uncertainty of one recorded input and the encoder's step, from the record itself.

    A stage moves at constant speed nearly always, so third differences are noise; their median resists reversals.

    Returns
    -------
    sigma_mm, step_mm : float
        The step is 0 where the values do not lie on a grid.
    """
    third = np.concatenate([np.diff(input_mm[run], 3) for run in runs] or [np.zeros(1)])
    sigma = float(np.median(np.abs(third)) / 0.6745 / np.sqrt(20.0)) if third.size else 0.0
    values = np.unique(np.round(input_mm, 9))
    steps = np.diff(values)
    step = 0.0
    if steps.size and values.size < 0.7 * input_mm.size:
        smallest = float(np.min(steps[steps > 1e-7])) if np.any(steps > 1e-7) else 0.0
        if smallest > 0.0 and np.all(np.abs(steps / smallest - np.round(steps / smallest)) < 0.02):
            step = smallest
    if step > 0.0:
        sigma = max(sigma, step / np.sqrt(12.0))
    return (sigma if sigma > 1e-7 * np.ptp(input_mm) else 0.0), step


@compiled_as_written
def _lines(time_s: Array, input_mm: Array, sigma: float, windows: Array) -> tuple[Array, Array]:
    count = input_mm.size
    smooth, leverage = input_mm.copy(), np.ones(count)
    inside = np.zeros(count)
    for i in range(count):
        for width in windows:
            # A window that ends at the sample reaches up to a reversal without rounding it.
            for place in range(5):
                m = int(width)
                low = i - (place * (m - 1)) // 4
                high = low + m
                if low < 0 or high > count:
                    continue
                t0 = 0.0
                u0 = 0.0
                for j in range(low, high):
                    t0 += time_s[j]
                    u0 += input_mm[j]
                t0 /= m
                u0 /= m
                stt = 0.0
                stu = 0.0
                for j in range(low, high):
                    stt += (time_s[j] - t0) ** 2
                    stu += (time_s[j] - t0) * input_mm[j]
                weight = 1.0 / m + (time_s[i] - t0) ** 2 / stt
                depth = min(i - low, high - 1 - i)
                if weight >= leverage[i] and depth <= inside[i]:
                    continue
                slope = stu / stt
                reach = 0.5 * (time_s[high - 1] - time_s[low])
                chi = 0.0
                bend = 0.0
                norm = 0.0
                ends = 0.0
                for j in range(low, high):
                    e = input_mm[j] - u0 - slope * (time_s[j] - t0)
                    x = (time_s[j] - t0) / reach
                    chi += e * e
                    bend += e * (x * x - 1.0 / 3.0)
                    norm += (x * x - 1.0 / 3.0) ** 2
                    if j < low + 3 or j >= high - 3:
                        ends = max(ends, abs(e))
                dof = m - 2
                fits = chi / sigma**2 <= dof + 2.5 * np.sqrt(2.0 * dof) and ends <= 3.0 * sigma
                if fits and abs(bend) <= 2.0 * sigma * np.sqrt(norm):
                    inside[i] = max(inside[i], depth)
                    if weight < leverage[i]:
                        smooth[i] = u0 + slope * (time_s[i] - t0)
                        leverage[i] = weight
    # A stage comes to its speed in no time only on paper: a corner rounded by less than the noise passes every test
    # above, so that at a line's end nothing but the samples beyond it vouch for the line.
    return smooth, np.maximum(leverage, 1.0 / (1.0 + inside))


def smoothed(input_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float) -> tuple[Array, Array]:
    """Smooth the record within its runs.

    Returns
    -------
    input_mm, leverage : ndarray of float, shape (n,)
        The remaining variance of each value is `leverage * sigma_mm**2`; 1 where no line passed.
    """
    out, leverage = input_mm.copy(), np.ones_like(input_mm)
    for run in runs:
        if run.stop - run.start >= 5:
            out[run], leverage[run] = _lines(time_s[run], input_mm[run], sigma_mm, np.array(WINDOWS, dtype=np.float64))
    return out, leverage

"""The recorded input smoothed: local lines and parabolas through the record, as wide as the record allows."""

import numpy as np

from fingervision.domain.compiled import compiled_as_written
from fingervision.domain.effect import Array

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


@compiled_as_written
def _polynomial(
    time_s: Array, values: Array, at: int, low: int, high: int, degree: int, sigma: float, rounded: bool
) -> tuple[float, float, float, float, bool]:
    """Fit a polynomial to a window by orthogonal polynomials (Forsythe 1957).

    Returns
    -------
    value, leverage : float
        Of the polynomial at sample `at`: the leverage is its variance over that of one sample.
    top : float
        Coefficient of its highest power; 0 where that is not significant.
    missed : float
        What a unit of the next higher power would add at `at`, and the polynomial not show.
    passes : bool
        Whether the rest is noise of standard deviation `sigma`.
    """
    count = high - low
    middle = 0.5 * (time_s[low] + time_s[high - 1])
    rest = values[low:high].copy()
    before, now = np.zeros(count), np.ones(count)
    value, leverage, top, norm_before = 0.0, 0.0, 0.0, 1.0
    for power in range(degree + 2):
        norm, along, shift = 0.0, 0.0, 0.0
        for j in range(count):
            norm += now[j] * now[j]
            along += rest[j] * now[j]
            shift += (time_s[low + j] - middle) * now[j] * now[j]
        if power > degree:
            chi = 0.0
            for j in range(count):
                chi += rest[j] * rest[j]
            freedom = count - degree - 1
            ends = max(np.max(np.abs(rest[:3])), np.max(np.abs(rest[-3:])))
            passes = (
                chi / sigma**2 <= freedom + CHI_SIGMAS * np.sqrt(2.0 * freedom)
                and ends <= END_SIGMAS * sigma
                and abs(along) <= TREND_SIGMAS * sigma * np.sqrt(norm)
            )
            if rounded:
                # Where each sample is a whole number of steps on, all are rounded alike, and no mean shows it.
                leverage += max(0.0, 1.0 - chi / sigma**2 / freedom)
            return value, leverage, top, now[at - low], passes
        coefficient = along / norm
        value += coefficient * now[at - low]
        leverage += now[at - low] ** 2 / norm
        top = coefficient if abs(coefficient) * np.sqrt(norm) > CURVED_SIGMAS * sigma else 0.0
        shift /= norm
        ratio = norm / norm_before if power > 0 else 0.0
        for j in range(count):
            rest[j] -= coefficient * now[j]
            ahead = (time_s[low + j] - middle - shift) * now[j] - ratio * before[j]
            before[j] = now[j]
            now[j] = ahead
        norm_before = norm
    return value, leverage, top, 0.0, False


@compiled_as_written
def _local_polynomials(
    time_s: Array, input_mm: Array, sigma: float, rounded: bool, lines: Array, parabolas: Array
) -> tuple[Array, Array]:
    count = input_mm.size
    smooth, leverage = input_mm.copy(), np.ones(count)
    for i in range(count):
        # A line's last sample has nothing beyond it that vouches for the line: corners are rounded by less than shows.
        least = min(1, i, count - 1 - i)
        inside, curvature, bent_value, bent_leverage = 0, 0.0, 0.0, 1.0
        for degree in (2, 1):
            widths = parabolas if degree == 2 else lines
            for width in widths:
                if 1.0 / width >= (bent_leverage if degree == 2 else leverage[i]):
                    break
                for place in range(PLACES):
                    low = i - (place * (width - 1)) // (PLACES - 1)
                    high = low + width
                    depth = min(i - low, high - 1 - i)
                    if low < 0 or high > count or depth < least:
                        continue
                    value, weight, top, missed, passes = _polynomial(
                        time_s, input_mm, i, low, high, degree, sigma, rounded
                    )
                    if not passes:
                        continue
                    inside = max(inside, depth)
                    if degree == 2 and CHOSEN * weight < bent_leverage:
                        bent_value, bent_leverage, curvature = value, CHOSEN * weight, top
                    elif degree == 1:
                        # What the widest parabola bends away from this line counts as its error.
                        weight += (curvature * missed / sigma) ** 2
                        if weight < leverage[i]:
                            smooth[i], leverage[i] = value, weight
        if bent_leverage < leverage[i]:
            smooth[i], leverage[i] = bent_value, bent_leverage
        leverage[i] = max(leverage[i], 1.0 / (1.0 + inside))
    return smooth, leverage


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
            out[run], leverage[run] = _local_polynomials(
                time_s[run], input_mm[run], sigma_mm, step_mm > 0.0, np.array(LINES), np.array(PARABOLAS)
            )
    return out, leverage

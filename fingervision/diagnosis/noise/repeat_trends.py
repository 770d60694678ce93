"""Trends among repeated readings: drift, run-in, and noise that is correlated from reading to reading."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array

TREND_SIGMAS = 2.33
"""Standard deviations by which neighbouring visits must agree better than distant ones before a trend is assumed: by
chance in one table in a hundred."""
TREND_DEGREE = 3
"""Degree of the polynomial in time that removes a drift or a run-in from the repeats, sufficient for some cycles."""
MOST_WANDERING = 0.95
"""Largest correlation of successive readings; above it, correlated reading noise is a drift."""


def drift_sigmas(rest: Array, straight: Array, rows: NDArray[np.intp]) -> float:
    """Significance, in standard deviations, of a drift in successive readings; 0 if correlated noise is more probable.

    A drift (a smooth curve in time) and correlated reading noise both make successive readings similar, whatever their
    positions. Drift or correlated noise, whichever is more probable by BIC (Schwarz 1978), is assumed to be the cause:
    the log residual variances of the curve, and of predicting each reading from the previous one, are compared with
    penalties for the parameters.
    """
    share, sigmas = follows_sigmas(rest, rows)
    if sigmas <= TREND_SIGMAS:
        return 0.0
    pairs, parameter = int(np.sum(np.diff(np.sort(rows)) == 1)), float(np.log(rest.size))
    wanders = pairs * float(np.log1p(-(min(share, MOST_WANDERING) ** 2))) + parameter
    power, left = float(np.sum(rest**2)), float(np.sum(straight**2))
    drifts = rest.size * float(np.log(max(left, 1e-12 * power) / power)) + TREND_DEGREE * parameter
    return sigmas if drifts < wanders else 0.0


def without_trend(rest: Array, groups: list[NDArray[np.intp]], time_s: Array, *shares: Array) -> Array:
    """Subtract a polynomial in time, common to all groups, from the residuals of repeated readings.

    For each array of `shares` (one factor for each row), a further polynomial multiplied by this factor is subtracted,
    so that the trend may differ between positions or directions.
    """
    at = np.concatenate([time_s[group] for group in groups])
    powers = np.vander((at - at.mean()) / max(float(np.ptp(at)), 1e-300), TREND_DEGREE + 1)[:, :-1]
    own_rows = np.concatenate(groups)
    powers = np.hstack([powers, *(powers * share[own_rows, None] for share in shares)])
    begin = 0
    for group in groups:
        own = slice(begin, begin + group.size)
        powers[own] -= powers[own].mean(axis=0)
        begin += group.size
    return np.asarray(rest - powers @ np.linalg.lstsq(powers, rest, rcond=None)[0], dtype=np.float64)


def wandering(rest: Array, rows: NDArray[np.intp]) -> float:
    """Correlation of the repeats' residuals in successive rows; 0 if it could be due to chance."""
    share, sigmas = follows_sigmas(rest, rows)
    return min(share, MOST_WANDERING) if sigmas > TREND_SIGMAS else 0.0


def follows_sigmas(rest: Array, rows: NDArray[np.intp]) -> tuple[float, float]:
    """Correlation of the repeats' residuals in successive rows, and its significance in standard deviations.

    For k independent pairs, the standard deviation of the correlation is 1 / sqrt(k) (Bartlett 1946,
    doi:10.2307/2983611).
    """
    ordered = rest[np.argsort(rows)]
    follows = np.diff(np.sort(rows)) == 1
    pairs = int(follows.sum())
    power = float(np.mean(rest**2))
    if pairs == 0 or power == 0.0:
        return 0.0, 0.0
    share = float(np.mean((ordered[:-1] * ordered[1:])[follows])) / power
    return share, share * float(np.sqrt(pairs))


def trend_sigmas(groups: list[Array], pooled: float) -> float:
    """Von Neumann's ratio over all groups, in standard deviations below its expectation (von Neumann 1941)."""
    if pooled <= 0.0:
        return 0.0
    neighbours = sum(float(np.sum(np.diff(group) ** 2)) for group in groups)
    pairs = sum(group.size - 1 for group in groups)
    ratio = 0.5 * neighbours / pairs / pooled
    # A group of k readings has the variance (k - 2) / (k^2 - 1); groups are weighted by their numbers of pairs.
    variance = sum((group.size - 1) ** 2 * (group.size - 2) / (group.size**2 - 1) for group in groups) / pairs**2
    return (1.0 - ratio) / float(np.sqrt(variance)) if variance > 0.0 else 0.0

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
WAVE_DEGREE, WAVE_MARGIN = 3, 10.0
"""Parameters of a wave over time (two amplitudes and the period), and the margin of BIC by which it must be more
probable than a polynomial or correlated noise: very strong evidence (Kass & Raftery 1995), because some period among
many always fits."""
READINGS_A_PERIOD = 4.0
"""Shortest period of a wave, in median times between readings: a shorter one would be noise from reading to reading."""
PERIODS_A_RECORD = 4
"""Trial frequencies per reciprocal of the record's duration, the width of a spectral line."""
REFINED = 9
"""Frequencies tried between two neighbouring trial frequencies, so that the phase is right to a few degrees."""


def drift_sigmas(rest: Array, drift_cost: float, rows: NDArray[np.intp], degrees: int) -> float:
    """Significance, in standard deviations, of a drift in successive readings; 0 if correlated noise is more probable.

    A drift (a smooth curve in time) and correlated reading noise both make successive readings similar, whatever their
    positions. Drift or correlated noise, whichever is more probable by BIC (Schwarz 1978), is assumed to be the cause:
    the log residual variances of the curve, and of predicting each reading from the previous one, are compared with
    penalties for the parameters.

    Parameters
    ----------
    rest : ndarray of float, shape (m,)
        Residuals of repeated readings.
    drift_cost : float
        BIC of the drift relative to that of no drift (`likelier_drift`).
    rows : ndarray of int, shape (m,)
        Row of each residual.
    degrees : int
        Number of independent residuals: one less than the readings of each group.
    """
    share, sigmas = follows_sigmas(rest, rows)
    if sigmas <= TREND_SIGMAS:
        return 0.0
    pairs, parameter = np.sum(np.diff(np.sort(rows)) == 1) * degrees / rest.size, float(np.log(rest.size))
    wanders = pairs * float(np.log1p(-(min(share, MOST_WANDERING) ** 2))) + parameter
    return sigmas if drift_cost < wanders else 0.0


def likelier_drift(rest: Array, groups: list[NDArray[np.intp]], time_s: Array) -> tuple[Array, int, float]:
    """Residuals of repeated readings without a polynomial in time or a wave over time, whichever is more probable.

    The temperature of a room rises and falls with its air conditioning, which no polynomial of low degree follows.

    Returns
    -------
    left : ndarray of float, shape (m,)
        Residuals without the drift.
    degree : int
        Number of parameters of the drift.
    cost : float
        BIC of the drift relative to that of no drift, with the margin that is asked of a wave.
    """
    straight, waved = without_trend(rest, groups, time_s), without_wave(rest, groups, time_s)
    plain = _cost(rest, straight, TREND_DEGREE, len(groups))
    wave = _cost(rest, waved, WAVE_DEGREE, len(groups)) + WAVE_MARGIN
    return (waved, WAVE_DEGREE, wave) if wave < plain else (straight, TREND_DEGREE, plain)


def _cost(rest: Array, left: Array, parameters: int, groups: int) -> float:
    """BIC of a drift with some parameters, relative to that of no drift.

    Each group's mean was subtracted from its readings, which leaves one independent value less per group.
    """
    power, independent = max(float(np.sum(rest**2)), 1e-300), rest.size - groups
    gained = independent * float(np.log(max(float(np.sum(left**2)), 1e-12 * power) / power))
    return gained + parameters * float(np.log(rest.size))


def without_wave(rest: Array, groups: list[NDArray[np.intp]], time_s: Array) -> Array:
    """Subtract the sinusoid in time, common to all groups, that explains most of the residuals of repeated readings."""
    at = np.concatenate([time_s[group] for group in groups])
    duration_s = float(np.ptp(at))
    apart_s = float(np.median(np.diff(np.sort(at)))) if at.size > 1 else 0.0
    if apart_s <= 0.0:
        return rest
    step_hz = 1.0 / (PERIODS_A_RECORD * duration_s)
    trials_hz = np.arange(PERIODS_A_RECORD * step_hz, 1.0 / (READINGS_A_PERIOD * apart_s), step_hz)
    _, best_hz = _without_sinusoid(rest, groups, at, trials_hz)
    return _without_sinusoid(rest, groups, at, best_hz + step_hz * np.linspace(-0.5, 0.5, REFINED))[0]


def _without_sinusoid(
    rest: Array, groups: list[NDArray[np.intp]], at_s: Array, trials_hz: Array
) -> tuple[Array, float]:
    """Residuals without the best of several sinusoids, and its frequency; 0 Hz if none explains anything."""
    left, best_hz = rest, 0.0
    for hz in trials_hz[trials_hz > 0.0].tolist():
        phase = 2.0 * np.pi * hz * at_s
        wave = _about_groups(np.stack([np.cos(phase), np.sin(phase)], axis=1), groups)
        found = rest - wave @ np.linalg.lstsq(wave, rest, rcond=1e-9)[0]
        if float(found @ found) < float(left @ left):
            left, best_hz = found, hz
    return np.asarray(left, dtype=np.float64), best_hz


def _about_groups(columns: Array, groups: list[NDArray[np.intp]]) -> Array:
    """Columns, shape (m, k), minus their mean in each group of repeated readings."""
    out, begin = columns.copy(), 0
    for group in groups:
        own = slice(begin, begin + group.size)
        out[own] -= out[own].mean(axis=0)
        begin += group.size
    return out


def without_trend(rest: Array, groups: list[NDArray[np.intp]], time_s: Array, *shares: Array) -> Array:
    """Subtract a polynomial in time, common to all groups, from the residuals of repeated readings.

    For each array of `shares` (one factor for each row), a further polynomial multiplied by this factor is subtracted,
    so that the trend may differ between positions or directions.
    """
    at = np.concatenate([time_s[group] for group in groups])
    powers = np.vander((at - at.mean()) / max(float(np.ptp(at)), 1e-300), TREND_DEGREE + 1)[:, :-1]
    own_rows = np.concatenate(groups)
    powers = np.hstack([powers, *(powers * share[own_rows, None] for share in shares)])
    powers = _about_groups(powers, groups)
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

"""Pure error: scatter between visits of the same input from the same side (ISO 230-2; Box & Draper 1987)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array, Flags

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


SAME_PLACE = 1e-6
"""Distance, as a share of the input's range, within which two set-points are equal: rounding in a file."""
FEWEST_DEGREES = 4
"""Least degrees of freedom of a scatter; with fewer it is uncertain by more than a factor of 1.4."""
APART = 0.25
"""Largest remaining share of the scatter's power for which different drifts of positions or sides, or zeros of runs,
are accepted as its cause: such drifts have many coefficients for a few dozen repeats, and without them the noise is
overestimated by at most a factor of 2."""
OFF_GRID = 0.02
"""Distance, in grid steps, of a difference from a multiple of the smallest one that is attributed to rounding."""
MOST_DECIMALS = 10
"""Number of decimals, in mm, beyond which a digit is that of floating point and not of a reading."""
BY_ACCIDENT = 1e-3
"""Probability of so close multiples by chance, below which the differences are assumed to lie on a grid."""
FEWEST_STEPS = 8
"""Least number of differences between neighbouring values from which a grid is determined."""
LEVELS = 4096
"""Assumed number of levels of a reading without visible digits: 12 bits, as in servo encoders and inexpensive
converters."""


@dataclass(frozen=True, slots=True)
class PureError:
    """Scatter of repeats.

    Parameters
    ----------
    sd_mm : float
        Standard deviation of one reading, after removal of a trend.
    degrees : int
        Degrees of freedom.
    trend_sigmas : float
        Significance, in standard deviations, of the better agreement of successive visits.
    correlation : float
        Correlation of the repeats' residuals in successive readings, at any position (correlated reading noise); 0 if
        it could be chance.
    """

    sd_mm: float
    degrees: int
    trend_sigmas: float
    correlation: float = 0.0

    @property
    def has_trend(self) -> bool:
        """Whether the repeated readings show a drift or a run-in."""
        return self.trend_sigmas > TREND_SIGMAS


def visits(path_mm: Array, runs: tuple[slice, ...], rows: NDArray[np.intp], *, first: bool = False) -> NDArray[np.intp]:
    """Number the combinations of position and side of approach that the stage visited.

    Parameters
    ----------
    path_mm : ndarray of float, shape (m,)
        Recorded input, including rows without a gap.
    runs : tuple of slice
        Rows of the path in each run.
    rows : ndarray of int, shape (n,)
        Indices of the measured rows in the path.
    first : bool
        Whether the first rows of runs at one input count as visits from the same side, although the side is not known.

    Returns
    -------
    ndarray of int, shape (n,)
        The same number for all visits of one input from one side; -1 if the side is not known (at the first input of a
        run), and for further readings of the same visit.
    """
    near = SAME_PLACE * max(float(np.ptp(path_mm)), 1e-300)
    place = np.round(path_mm / near).astype(np.int64)
    _, place = np.unique(place, return_inverse=True)
    side = np.zeros(path_mm.size, dtype=np.int64)
    new = np.zeros(path_mm.size, dtype=bool)
    measured = np.zeros(path_mm.size, dtype=bool)
    measured[rows] = True
    for run in runs:
        seen = False
        for i in range(run.start + 1, run.stop):
            way = np.sign(path_mm[i] - path_mm[i - 1]) if abs(path_mm[i] - path_mm[i - 1]) > near else 0.0
            side[i] = way or side[i - 1]
            seen = measured[i - 1] or (seen and not way)
            new[i] = way != 0.0 or not seen
    label = np.where((side != 0) & new, 2 * place + (side > 0), -1)
    if first:
        begins = np.array([run.start for run in runs], dtype=np.intp)
        label[begins] = 2 * int(place.max(initial=0)) + 2 + place[begins]
    return label[rows]


def repeats_in(label: NDArray[np.intp], runs: tuple[slice, ...]) -> int:
    """Degrees of freedom that labelled visits have beside an offset of each run."""
    counts = np.unique(label[label >= 0], return_counts=True)[1]
    return int(np.sum(counts - 1)) - (len(runs) - 1)


def pure_error(
    values: Array,
    time_s: Array,
    label: NDArray[np.intp],
    aside: Flags,
    place_mm: Array | None = None,
    runs: tuple[slice, ...] = (),
) -> PureError | None:
    """Estimate the scatter of repeated readings; None if there are too few repeated readings.

    Parameters
    ----------
    values : ndarray of float, shape (n,)
        Measured values, or measured minus predicted values.
    time_s : ndarray of float, shape (n,)
        Time of each reading.
    label : ndarray of int, shape (n,)
        Result of `visits`.
    aside : ndarray of bool, shape (n,)
        Excluded values.
    place_mm : ndarray of float, shape (n,), or None
        Recorded input of each reading, if positions may drift differently; None to exclude that.
    runs : tuple of slice
        Rows of each run, if offsets of runs are not part of the readings' scatter; empty to exclude that.
    """
    numbers, counts = np.unique(label[(label >= 0) & ~aside], return_counts=True)
    groups = [np.flatnonzero((label == number) & ~aside) for number in numbers[counts > 1]]
    groups = [group[np.argsort(time_s[group], kind="stable")] for group in groups]
    degrees = sum(group.size - 1 for group in groups)
    values, zeroings = _without_run_offsets(values, groups, runs)
    degrees -= zeroings
    if degrees < FEWEST_DEGREES:
        return None
    rest = np.concatenate([values[group] - values[group].mean() for group in groups])
    pooled = float(rest @ rest) / degrees
    trend = trend_sigmas([values[group] for group in groups], pooled)
    rows = np.concatenate(groups)
    straight, taken, cost = likelier_drift(rest, groups, time_s)
    if place_mm is not None and degrees - 3 * TREND_DEGREE >= FEWEST_DEGREES:
        ends = np.cumsum([group.size for group in groups])[:-1]
        left = float(straight @ straight) / (degrees - taken)
        if trend_sigmas(np.split(straight, ends), left) > TREND_SIGMAS:
            # Positions may drift differently (a change of gain), or sides of approach (a play that runs in).
            centred = (place_mm - place_mm.mean()) / max(float(np.ptp(place_mm)), 1e-300)
            apart = without_trend(rest, groups, time_s, centred, np.where(label % 2, 0.5, -0.5))
            if float(apart @ apart) / (degrees - 3 * TREND_DEGREE) < APART * left:
                straight, taken = apart, 3 * TREND_DEGREE
    if trend <= TREND_SIGMAS and degrees - taken >= FEWEST_DEGREES:
        trend = max(trend, drift_sigmas(rest, cost, rows, rows.size - len(groups)))
    if trend <= TREND_SIGMAS or degrees - taken < FEWEST_DEGREES:
        straight, taken = rest, 0
    degrees -= taken
    return PureError(float(np.sqrt(straight @ straight / degrees)), degrees, trend, wandering(straight, rows))


def _without_run_offsets(values: Array, groups: list[NDArray[np.intp]], runs: tuple[slice, ...]) -> tuple[Array, int]:
    """Subtract each run's own zero if it causes most of the scatter; return also the number of subtracted zeros."""
    if len(runs) < 2 or not groups:
        return values, 0
    number = np.zeros(values.size, dtype=np.intp)
    for index, run in enumerate(runs):
        number[run] = index
    own = (number[:, None] == np.arange(1, len(runs))).astype(np.float64)
    rows = np.concatenate(groups)
    rest = np.concatenate([values[group] - values[group].mean() for group in groups])
    design = np.concatenate([own[group] - own[group].mean(axis=0) for group in groups])
    zeros, _, rank, _ = np.linalg.lstsq(design, rest, rcond=1e-9)
    left, degrees = rest - design @ zeros, sum(group.size - 1 for group in groups)
    if rank >= degrees or float(left @ left) / (degrees - rank) >= APART * float(rest @ rest) / degrees:
        return values, 0
    out = values.copy()
    out[rows] -= own[rows] @ zeros
    return out, int(rank)


def resolution(values: Array) -> float:
    """Spacing of the grid on which all values lie, as for readings with few digits; 0 if there is no grid.

    If there are too few distinct values to estimate a spacing, a 12-bit reading over their range is assumed.
    """
    steps = np.diff(np.unique(np.round(values, 10)))
    steps = steps[steps > 1e-9]
    if not steps.size:
        return 0.0
    least = float(np.min(steps))
    multiples = steps / least
    off = np.abs(multiples - np.round(multiples))
    # Readings at evenly spaced targets are nearly multiples too, but differ by more than their last written digit.
    on_grid = bool(np.all(off < OFF_GRID) and np.all(off * least <= (1.0 + multiples) * _last_digit(values)))
    further = int(np.sum(multiples > 1.5))
    if steps.size < FEWEST_STEPS and not (on_grid and (2.0 * OFF_GRID) ** further < BY_ACCIDENT):
        return float(np.ptp(values)) / LEVELS
    return least if on_grid else 0.0


def _last_digit(values: Array) -> float:
    """Unit of the last decimal digit with which the values are written (mm)."""
    for decimals in range(MOST_DECIMALS):
        if np.all(np.abs(values - np.round(values, decimals)) < 10.0**-MOST_DECIMALS):
            return float(10.0**-decimals)
    return float(10.0**-MOST_DECIMALS)

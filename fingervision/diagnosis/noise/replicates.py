"""Pure error: scatter between visits of the same input from the same side (ISO 230-2; Box & Draper 1987)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array, Flags

SAME_PLACE = 1e-6
"""Distance, as a share of the input's range, within which two set-points are equal: rounding in a file."""
FEWEST_DEGREES = 4
"""Least degrees of freedom of a scatter; with fewer it is uncertain by more than a factor of 1.4."""
TREND_SIGMAS = 2.33
"""Standard deviations by which neighbouring visits must agree better than distant ones before a trend is assumed: by
chance in one table in a hundred."""
TREND_DEGREE = 3
"""Degree of the polynomial in time that removes a drift or a run-in from the repeats, sufficient for some cycles."""
APART = 0.25
"""Largest remaining share of the scatter's power for which different drifts of positions or sides, or zeros of runs,
are accepted as its cause: they have many coefficients for a few dozen repeats, and without them the noise is at most a
factor of 2 too large."""
OFF_GRID = 0.02
"""Distance, in grid steps, of a difference from a multiple of the smallest one that is attributed to rounding."""
BY_ACCIDENT = 1e-3
"""Probability of so close multiples by chance, below which the differences lie on a grid."""
FEWEST_STEPS = 8
"""Least number of differences between neighbouring values from which a grid is determined."""
LEVELS = 4096
"""Assumed number of levels of a reading without visible digits: 12 bits, as in servo encoders and inexpensive
converters."""
MOST_WANDERING = 0.95
"""Largest correlation of successive readings; above it, correlated reading noise is a drift."""
ORDINARY_SIGMAS = 6.0
"""Robust standard deviations beyond which a single visit is a gross error."""


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


def visits(path_mm: Array, runs: tuple[slice, ...], rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Number the combinations of position and side of approach that the stage visited.

    Parameters
    ----------
    path_mm : ndarray of float, shape (m,)
        Recorded input, including rows without a gap.
    runs : tuple of slice
        Rows of the path in each run.
    rows : ndarray of int, shape (n,)
        Indices of the measured rows.

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
    label = 2 * place + (side > 0)
    return np.where((side != 0) & new, label, -1)[rows]


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
    trend = _trend_sigmas([values[group] for group in groups], pooled)
    rows = np.concatenate(groups)
    straight, taken = _without_trend(rest, groups, time_s), TREND_DEGREE
    if place_mm is not None and degrees - 3 * TREND_DEGREE >= FEWEST_DEGREES:
        ends = np.cumsum([group.size for group in groups])[:-1]
        left = float(straight @ straight) / (degrees - TREND_DEGREE)
        if _trend_sigmas(np.split(straight, ends), left) > TREND_SIGMAS:
            # Places that drift apart, as a gain does, or sides that do, as a play that runs in.
            centred = (place_mm - place_mm.mean()) / max(float(np.ptp(place_mm)), 1e-300)
            apart = _without_trend(rest, groups, time_s, centred, np.where(label % 2, 0.5, -0.5))
            if float(apart @ apart) / (degrees - 3 * TREND_DEGREE) < APART * left:
                straight, taken = apart, 3 * TREND_DEGREE
    if trend <= TREND_SIGMAS and degrees - TREND_DEGREE >= FEWEST_DEGREES:
        trend = max(trend, _drift_sigmas(rest, straight, rows))
    if trend <= TREND_SIGMAS or degrees - taken < FEWEST_DEGREES:
        return PureError(_without_gross_errors(rest, degrees), degrees, trend, _wandering(rest, rows))
    sd_mm = _without_gross_errors(straight, degrees - taken)
    return PureError(sd_mm, degrees - taken, trend, _wandering(straight, rows))


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


def _drift_sigmas(rest: Array, straight: Array, rows: NDArray[np.intp]) -> float:
    """Significance, in standard deviations, of a drift in successive readings; 0 if correlated noise is more probable.

    A drift (a smooth curve in time) and correlated reading noise both make successive readings similar, whatever their
    positions. The more probable of the two, by BIC (Schwarz 1978), is taken as the cause: the log residual variances of
    the curve, and of predicting each reading from the previous one, are compared with penalties for the parameters.
    """
    share, sigmas = _follows_sigmas(rest, rows)
    if sigmas <= TREND_SIGMAS:
        return 0.0
    pairs, parameter = int(np.sum(np.diff(np.sort(rows)) == 1)), float(np.log(rest.size))
    wanders = pairs * float(np.log1p(-(min(share, MOST_WANDERING) ** 2))) + parameter
    power, left = float(np.sum(rest**2)), float(np.sum(straight**2))
    drifts = rest.size * float(np.log(max(left, 1e-12 * power) / power)) + TREND_DEGREE * parameter
    return sigmas if drifts < wanders else 0.0


def _without_trend(rest: Array, groups: list[NDArray[np.intp]], time_s: Array, *shares: Array) -> Array:
    """Subtract a polynomial in time shared by all groups from the repeats' residuals, and one for each of `shares`."""
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


def _wandering(rest: Array, rows: NDArray[np.intp]) -> float:
    """Correlation of the repeats' residuals in successive rows; 0 if it is not significant."""
    share, sigmas = _follows_sigmas(rest, rows)
    return min(share, MOST_WANDERING) if sigmas > TREND_SIGMAS else 0.0


def _follows_sigmas(rest: Array, rows: NDArray[np.intp]) -> tuple[float, float]:
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


def _without_gross_errors(rest: Array, degrees: int) -> float:
    robust = 1.4826 * float(np.median(np.abs(rest)))
    kept = np.abs(rest) <= ORDINARY_SIGMAS * robust if robust > 0.0 else np.ones(rest.size, dtype=bool)
    return float(np.sqrt(np.sum(rest[kept] ** 2) / max(1, degrees - int(np.sum(~kept)))))


def _trend_sigmas(groups: list[Array], pooled: float) -> float:
    """Von Neumann's ratio over all groups, in standard deviations below its expectation (von Neumann 1941)."""
    if pooled <= 0.0:
        return 0.0
    neighbours = sum(float(np.sum(np.diff(group) ** 2)) for group in groups)
    pairs = sum(group.size - 1 for group in groups)
    ratio = 0.5 * neighbours / pairs / pooled
    # Of one group of k: variance (k - 2) / (k^2 - 1); groups count by their pairs.
    variance = sum((group.size - 1) ** 2 * (group.size - 2) / (group.size**2 - 1) for group in groups) / pairs**2
    return (1.0 - ratio) / float(np.sqrt(variance)) if variance > 0.0 else 0.0


def resolution(values: Array) -> float:
    """Spacing of the grid on which all values lie, as for readings with few digits; 0 without such a grid.

    If there are too few distinct values to estimate a spacing, a 12-bit reading over their range is assumed.
    """
    steps = np.diff(np.unique(np.round(values, 10)))
    steps = steps[steps > 1e-9]
    if not steps.size:
        return 0.0
    least = float(np.min(steps))
    multiples = steps / least
    on_grid = bool(np.all(np.abs(multiples - np.round(multiples)) < OFF_GRID))
    further = int(np.sum(multiples > 1.5))
    if steps.size < FEWEST_STEPS and not (on_grid and (2.0 * OFF_GRID) ** further < BY_ACCIDENT):
        return float(np.ptp(values)) / LEVELS
    return least if on_grid else 0.0

"""Noise model of one channel: white noise plus a first-order autoregression, and outliers."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaln

from fingervision.domain.effect import Array, Flags

LEAST_SHARE = 0.1
"""Least share of a residual's variance that is due to the picture."""
AFTER_A_STEP = 5
"""Number of samples after a step of the input that are examined: five successive deviations are never outliers."""
PLACES, ENDS = 20, (2, 3, 5, 8)
"""Number of parts of the input's range that are examined, and numbers of samples at either end of the range, where
stops act."""
BY_CHANCE = 2e-3
"""Probability below which an accumulation of gross errors in one part is not due to chance."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of the white and the correlated part, and correlation of neighbouring samples.

    `slow_doubt` is the standard uncertainty of the logarithm of the noise power at low frequency.
    """

    white_mm: float
    correlated_mm: float
    correlation: float
    slow_doubt: float = 0.0

    @property
    def total_mm(self) -> float:
        """Standard deviation of the total noise of one sample (mm)."""
        return float(np.hypot(self.white_mm, self.correlated_mm))

    def scaled(self, by: float) -> "Noise":
        """Return noise of the same correlation, larger by a factor."""
        return replace(self, white_mm=by * self.white_mm, correlated_mm=by * self.correlated_mm)


MEDIAN_SAMPLES, FEWEST_SAMPLES = 7, 9
"""Number of samples of the running median, which a pair of outliers cannot change, and least number of samples of a run
for which the ends do not dominate."""
CROWDED = 4
"""Number of outliers among five successive samples that indicates a motion: a real reversal also moves its neighbours,
whereas outliers are single or in pairs."""


def gate(
    residual: Array,
    input_mm: Array,
    runs: tuple[slice, ...],
    ordered: bool,
    sigmas: float | None,
    change_mm: Array | None = None,
) -> Flags:
    """Mark outliers against a running median; shape (n,), True where a value is to be excluded.

    Without times the rows have no order, and the median of all values replaces the running median. `sigmas` is the
    limit of an outlier in standard deviations. If `sigmas` is None, no value is excluded, because in a short record an
    effect that acts on a few samples looks like outliers until it is explained. `change_mm`, shape (n,), is what the
    effects found so far change: a row too early or too late at their jumps is an error of theirs.
    """
    out = np.zeros(residual.size, dtype=bool)
    if sigmas is None:
        return out
    rest = residual.copy()
    for run in runs:
        values = residual[run]
        if ordered and values.size >= FEWEST_SAMPLES:
            padded = np.pad(values, MEDIAN_SAMPLES // 2, mode="reflect")
            windows = np.lib.stride_tricks.sliding_window_view(padded, MEDIAN_SAMPLES)
            rest[run] = values - np.median(windows, axis=1)
        else:
            rest[run] = values - np.median(values)
    # With whole pixels, many residuals are exactly zero, and the median would be zero too: use the 90 % quantile as
    # well.
    middle, far = np.quantile(np.abs(rest), (0.5, 0.9))
    sigma = max(1.4826 * float(middle), float(far) / 1.645)
    if sigma > 0.0:
        out = np.abs(rest) > sigmas * sigma
        if ordered and out.any():
            there = _recurring(out, [*_places(input_mm), *_after_steps(input_mm, runs), _at_jumps(change_mm)])
            for i in 2 + np.flatnonzero(np.convolve(out, np.ones(5))[4:-4] >= CROWDED):
                if out[i - 2 : i + 3].sum() >= CROWDED:
                    out[i - 2 : i + 3] = False
            out &= ~there
    return out


def _recurring(out: Flags, parts: list[NDArray[np.intp]]) -> Flags:
    """Mark parts of the range with more deviating samples than gross errors would cause, which occur anywhere."""
    there = np.zeros(out.size, dtype=bool)
    for part in parts:
        there[part] |= _at_least(int(out[part].sum()), part.size, int(out.sum()), out.size) < BY_CHANCE / len(parts)
    return there


def _at_least(seen: int, drawn: int, marked: int, total: int) -> float:
    """Probability of at least `seen` marked ones among `drawn` of `total` (hypergeometric distribution)."""
    hits = np.arange(max(seen, drawn + marked - total), min(drawn, marked) + 1)
    chances = (
        _log_choose(marked, hits) + _log_choose(total - marked, drawn - hits) - _log_choose(total, np.array(drawn))
    )
    return float(np.exp(chances).sum())


def _log_choose(total: int, taken: NDArray[np.intp]) -> Array:
    return np.asarray(-np.log1p(total) - betaln(total - taken + 1.0, taken + 1.0), dtype=np.float64)


def _places(input_mm: Array) -> list[NDArray[np.intp]]:
    """Group samples near the same input, and those at the ends of the range, where a contact or a stop acts."""
    order = np.argsort(input_mm, kind="stable")
    ends = [part for count in ENDS for part in (order[:count], order[-count:])]
    return [*np.array_split(order, min(PLACES, order.size)), *ends]


def _after_steps(input_mm: Array, runs: tuple[slice, ...]) -> list[NDArray[np.intp]]:
    """Group samples at equal times after a step of a held input, when the stage is still moving."""
    steps = np.concatenate([run.start + 1 + np.flatnonzero(np.diff(input_mm[run])) for run in runs])
    if not 0 < steps.size <= input_mm.size // (2 * AFTER_A_STEP):
        return []
    last = np.repeat([run.stop for run in runs], [run.stop - run.start for run in runs])
    return [steps[steps + lag < last[steps]] + lag for lag in range(AFTER_A_STEP)]


def _at_jumps(change_mm: Array | None) -> NDArray[np.intp]:
    """Samples before and after the largest changes from sample to sample."""
    moved = np.abs(np.diff(np.zeros(1) if change_mm is None else change_mm))
    before = np.flatnonzero(moved > 0.5 * np.max(moved, initial=0.0))
    return np.unique([before, before + 1])


def white_noise(residual: Array, aside: Flags, floor_mm: float, degrees: int) -> Noise:
    """Treat the scatter of the values about their median as white noise: without times nothing else can be estimated.

    Parameters
    ----------
    residual : ndarray of float, shape (n,)
        Measured minus predicted values.
    aside : ndarray of bool, shape (n,)
        Outliers.
    floor_mm : float
        Random uncertainty of the measurement itself.
    degrees : int
        Number of fitted parameters.
    """
    kept = residual[~aside]
    spread = float(np.sqrt(np.sum((kept - np.median(kept)) ** 2) / max(1, kept.size - 1 - degrees)))
    return Noise(max(spread, floor_mm, 1e-9), 0.0, 0.0)


def without_input(noise: Noise, input_mm: Array, floor_mm: float) -> Noise:
    """Subtract the contribution of the input's random errors, which is also contained in the residual.

    Parameters
    ----------
    noise : Noise
        Noise estimated from the residual.
    input_mm : ndarray of float, shape (n,)
        Effect of each recorded input's error on the gap; it is accounted for separately from then on.
    floor_mm : float
        Random uncertainty of the measurement itself, which is no error of the input.
    """
    least = np.clip((floor_mm / noise.total_mm) ** 2, LEAST_SHARE, 1.0)
    share = 1.0 - float(np.mean(input_mm**2)) / noise.total_mm**2
    return noise.scaled(float(np.sqrt(max(share, least))))

"""Noise model of one channel: white noise plus a first-order autoregression, and outliers."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import hypergeom

from fingervision.domain.effect import Array, Flags

LEAST_SHARE = 0.1
"""Of a residual's variance that is the picture's own at least."""
AFTER_A_STEP = 5
"""Samples after a step of the input that are looked at: five in a row off are no outliers in any case."""
PLACES, ENDS = 20, (2, 3, 5, 8)
"""Parts of the input's range that are looked at, and how many samples at either end of it: stops act there."""
BY_CHANCE = 2e-3
"""How seldom as many gross errors may crowd in any one part by chance."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of the white and the correlated part, and the correlation of neighbouring samples.

    `slow_doubt` is the standard uncertainty of the logarithm of the power at low frequency.
    """

    white_mm: float
    correlated_mm: float
    correlation: float
    slow_doubt: float = 0.0

    @property
    def total_mm(self) -> float:
        """Standard deviation of one sample (mm)."""
        return float(np.hypot(self.white_mm, self.correlated_mm))


def gate(residual: Array, input_mm: Array, runs: tuple[slice, ...], ordered: bool, sigmas: float | None) -> Flags:
    """Mark outliers against a running median; shape (n,), True where a value is to be excluded.

    Without times there is no order, and the median of all values replaces the running one. `sigmas` is the limit; None
    excludes nothing: in a short record an effect that acts on a few samples looks like outliers until it is explained.
    """
    out = np.zeros(residual.size, dtype=bool)
    if sigmas is None:
        return out
    rest = residual.copy()
    for run in runs:
        values = residual[run]
        if ordered and values.size >= 9:
            padded = np.pad(values, 3, mode="reflect")
            windows = np.lib.stride_tricks.sliding_window_view(padded, 7)
            rest[run] = values - np.median(windows, axis=1)
        else:
            rest[run] = values - np.median(values)
    # Whole pixels leave many residuals at exactly zero: the 90 % point sees what the median then misses.
    middle, far = np.quantile(np.abs(rest), (0.5, 0.9))
    sigma = max(1.4826 * float(middle), float(far) / 1.645)
    if sigma > 0.0:
        out = np.abs(rest) > sigmas * sigma
        if ordered:
            there = _recurring(out, [*_places(input_mm), *_after_steps(input_mm, runs)])
            # A real reversal moves neighbours too; an outlier stands alone or in pairs.
            for i in range(2, residual.size - 2):
                if out[i - 2 : i + 3].sum() >= 4:
                    out[i - 2 : i + 3] = False
            out &= ~there
    return out


def _recurring(out: Flags, parts: list[NDArray[np.intp]]) -> Flags:
    """Where more samples are off than gross errors would explain, which occur at any input and any time."""
    there = np.zeros(out.size, dtype=bool)
    for part in parts:
        by_chance = hypergeom.sf(out[part].sum() - 1, out.size, int(out.sum()), part.size)
        there[part] |= by_chance < BY_CHANCE / len(parts)
    return there


def _places(input_mm: Array) -> list[NDArray[np.intp]]:
    """Samples near the same input, and at the ends of its range, where a contact or a stop acts."""
    order = np.argsort(input_mm, kind="stable")
    ends = [part for count in ENDS for part in (order[:count], order[-count:])]
    return [*np.array_split(order, min(PLACES, order.size)), *ends]


def _after_steps(input_mm: Array, runs: tuple[slice, ...]) -> list[NDArray[np.intp]]:
    """Samples at equal times after steps of a held input, when the stage is still moving."""
    steps = np.concatenate([run.start + 1 + np.flatnonzero(np.diff(input_mm[run])) for run in runs])
    if not 0 < steps.size <= input_mm.size // (2 * AFTER_A_STEP):
        return []
    last = np.repeat([run.stop for run in runs], [run.stop - run.start for run in runs])
    return [steps[steps + lag < last[steps]] + lag for lag in range(AFTER_A_STEP)]


def white_noise(residual: Array, aside: Flags, floor_mm: float, degrees: int) -> Noise:
    """Treat the scatter about the median as white noise, because without times nothing else can be estimated.

    Parameters
    ----------
    residual : ndarray of float, shape (n,)
        Measured minus predicted.
    aside : ndarray of bool, shape (n,)
        Outliers.
    floor_mm : float
        The measurement's own random part.
    degrees : int
        Parameters that were fitted.
    """
    kept = residual[~aside]
    spread = float(np.sqrt(np.sum((kept - np.median(kept)) ** 2) / max(1, kept.size - 1 - degrees)))
    return Noise(max(spread, floor_mm, 1e-9), 0.0, 0.0)


def without_input(noise: Noise, input_mm: Array) -> Noise:
    """Subtract the contribution of the input's random errors, which the residual contains too.

    Parameters
    ----------
    noise : Noise
        As it was estimated from the residual.
    input_mm : ndarray of float, shape (n,)
        What the error of each recorded input does to the gap; it counts beside the noise from now on.
    """
    share = 1.0 - float(np.mean(input_mm**2)) / noise.total_mm**2
    scale = float(np.sqrt(max(share, LEAST_SHARE)))
    return replace(noise, white_mm=scale * noise.white_mm, correlated_mm=scale * noise.correlated_mm)

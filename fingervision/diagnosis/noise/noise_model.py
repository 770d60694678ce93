"""Noise of one channel, white plus a first-order autoregression, and the outliers that are no part of it."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import hypergeom

from fingervision.domain.effect import Array, Flags

LEAST_SHARE = 0.1
"""Of a residual's variance that is the picture's own at least."""
PLACES, ENDS = 20, (2, 3, 5, 8)
"""Parts of the input's range that are looked at, and how many samples at either end of it: stops act there."""
BY_CHANCE = 2e-3
"""How seldom as many gross errors may crowd in any one part by chance."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of the white and the correlated part, and the correlation of neighbouring samples.

    `slow_doubt` is the standard uncertainty of the logarithm of the power where it is slow.
    """

    white_mm: float
    correlated_mm: float
    correlation: float
    slow_doubt: float = 0.0

    @property
    def total_mm(self) -> float:
        """Standard deviation of one sample."""
        return float(np.hypot(self.white_mm, self.correlated_mm))


def gate(residual: Array, input_mm: Array, runs: tuple[slice, ...], ordered: bool, sigmas: float | None) -> Flags:
    """Mark outliers against a running median; shape (n,), True where a value is to be set aside.

    Without an order (no times) the median of all stands for the running one. `sigmas` is the limit; None sets nothing
    aside: in a short record an effect that acts on a few samples looks like outliers until it is explained.
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
            there = _at_one_place(out, input_mm)
            # A real reversal moves neighbours too; an outlier stands alone or in pairs.
            for i in range(2, residual.size - 2):
                if out[i - 2 : i + 3].sum() >= 4:
                    out[i - 2 : i + 3] = False
            out &= ~there
    return out


def _at_one_place(out: Flags, input_mm: Array) -> Flags:
    """Where more samples are off than gross errors would be, which come at any input: a contact, a stop."""
    order = np.argsort(input_mm, kind="stable")
    there = np.zeros(out.size, dtype=bool)
    ends = [part for count in ENDS for part in (order[:count], order[-count:])]
    parts = [*np.array_split(order, min(PLACES, out.size)), *ends]
    for part in parts:
        by_chance = hypergeom.sf(out[part].sum() - 1, out.size, int(out.sum()), part.size)
        there[part] |= by_chance < BY_CHANCE / len(parts)
    return there


def white_noise(residual: Array, aside: Flags, floor_mm: float, degrees: int) -> Noise:
    """Take the scatter about the median for white noise: without times nothing else can be known.

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
    """Take out what the input's passing errors added, which the residual held too.

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

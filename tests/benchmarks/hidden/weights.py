"""Whitening with the noise that was simulated: the metric of all distances in the benchmark."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """Transforms (gap, midline, force) to numbers whose sum of squares is a chi-square.

    Parameters
    ----------
    gap_sd_mm, midline_sd_mm : ndarray, shape (n,)
        Standard deviation of each sample; that of the gap includes the error of the input.
    correlation : float
        AR(1) coefficient within each run.
    run_offset_mm : float
        Standard deviation of one edge's offset per run, over which the likelihood is marginalised.
    starts : ndarray of int, shape (runs + 1,)
        First sample of each run.
    force_sd_n : float or None
        None without a force column.
    """

    gap_sd_mm: Array
    midline_sd_mm: Array
    correlation: float
    run_offset_mm: float
    starts: NDArray[np.int64]
    force_sd_n: float | None

    def _whitened(self, values: Array, sd: Array, offset_mm: float) -> tuple[Array, Array]:
        """Whitened values, and the chi-square of the mean of each run."""
        rho = self.correlation
        ones = 1 / sd
        z = values / sd
        out, one = np.empty_like(z), np.empty_like(z)
        for raw, white in ((z, out), (ones, one)):
            white[1:] = (raw[1:] - rho * raw[:-1]) / np.sqrt(1 - rho**2)
            white[self.starts[:-1]] = raw[self.starts[:-1]]
        between = np.zeros(len(self.starts) - 1)
        for r, (a, b) in enumerate(zip(self.starts[:-1], self.starts[1:], strict=True)):
            w = one[a:b]
            ww = w @ w
            share = (w @ out[a:b]) / ww
            keep = 1 / np.sqrt(1 + offset_mm**2 * ww)
            out[a:b] -= (1 - keep) * share * w
            between[r] = (keep * share) ** 2 * ww
        return out, between

    def apply(self, gap: Array, midline: Array, force: Array) -> Array:
        """Whitened residual without the constant of the midline; shape (2 n,), or (3 n,) with force."""
        gap_w, _ = self._whitened(gap, self.gap_sd_mm, np.sqrt(2) * self.run_offset_mm)
        mid_w, _ = self._whitened(midline, self.midline_sd_mm, self.run_offset_mm / np.sqrt(2))
        one, _ = self._whitened(np.ones_like(midline), self.midline_sd_mm, self.run_offset_mm / np.sqrt(2))
        mid_w = mid_w - one * (one @ mid_w) / (one @ one)
        parts = [gap_w, mid_w]
        if self.force_sd_n is not None:
            parts.append(force / self.force_sd_n)
        return np.concatenate(parts)

    def cautious(self, chi_square: float, gap: Array, midline: Array) -> float:
        """Chi-square if the variance between runs is unknown and profiled: the part of the runs is R log(1 + q / R)."""
        runs = len(self.starts) - 1
        if runs < 2:
            return chi_square
        middle = midline - midline.mean()
        rest = chi_square
        for values, sd, offset in (
            (gap, self.gap_sd_mm, np.sqrt(2) * self.run_offset_mm),
            (middle, self.midline_sd_mm, self.run_offset_mm / np.sqrt(2)),
        ):
            between = min(float(self._whitened(values, sd, offset)[1].sum()), rest)
            rest += runs * float(np.log1p(between / runs)) - between
        return rest

"""Whitening: convert correlated noise of unequal variance to unit white noise, by a Kalman filter (Kalman 1960)."""

from dataclasses import dataclass, field

import numpy as np

from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.domain.effect import Array, Flags, History
from fingervision.domain.loops import loop

GAINS = 5
"""Number of values per sample that the filter needs (`whitening.c`)."""

_gains, _innovations = loop("whitening_gains"), loop("whitening_innovations")


@dataclass(frozen=True, slots=True, eq=False)
class Whitener:
    """Covariance of the observations, and the whitening operation; channels are stacked as gap, midline, force.

    Parameters
    ----------
    history : History
        Runs and times.
    noises : tuple of Noise
        One noise per channel.
    aside : ndarray of bool, shape (channels * n,)
        Outliers, which are treated as not measured.
    input_mm : ndarray of float, shape (n,)
        Standard deviation of the gap due to an input error that is constant over samples; 0 if there is none.
    input_samples : float
        Number of samples for which this error is constant.
    passing_mm : ndarray of float, shape (n,)
        Standard deviation of the gap due to input errors that differ between samples.
    drawing : ndarray of float, shape (channels * n, p), or None
        Change of the prediction per standard uncertainty of each uncertain dimension of the drawing.
    """

    history: History
    noises: tuple[Noise, ...]
    aside: Flags
    input_mm: Array
    input_samples: float
    passing_mm: Array
    drawing: Array | None = None
    _filter: tuple[Array, Array, float] = field(init=False, repr=False)

    @property
    def random_mm(self) -> Array:
        """Columns of the random effects; shape (channels * n, p)."""
        return np.zeros((self.aside.size, 0)) if self.drawing is None else self.drawing

    def __post_init__(self) -> None:
        """Compute the filter's gains once, because they are the same for every prediction of a search."""
        history = self.history
        n, clock = history.input_mm.size, history.time_s
        step = 1.0 if clock is None else max(history.sample_time_s, 1e-9)
        time = np.arange(n, dtype=np.float64) if clock is None else np.asarray(clock / step, dtype=np.float64)
        gains, total = np.empty((len(self.noises) * n, GAINS)), 0.0
        for channel, noise in enumerate(self.noises):
            white = noise.white_mm**2 + (self.passing_mm**2 if channel == 0 else np.zeros(n))
            part = slice(channel * n, (channel + 1) * n)
            white[self.aside[part]] = -1.0
            lag1 = -float(np.log(max(noise.correlation, 1e-6)))
            share = self._shares(channel)
            lag2 = 50.0 if self.input_samples <= 1.0 else 2.0 / self.input_samples
            for run in history.runs:
                own = gains[part][run]
                total += _gains(time[run], white[run], noise.correlated_mm**2, lag1, share[run], 1.0, lag2, own)
        shares = np.concatenate([self._shares(channel) for channel in range(len(self.noises))])
        object.__setattr__(self, "_filter", (gains, np.asarray(shares, dtype=np.float64), total))

    def _shares(self, channel: int) -> Array:
        """Contribution (mm) of a constant error of the input to each sample of a channel; shape (n,)."""
        return np.asarray(self.input_mm if channel == 0 else np.zeros(self.input_mm.size), dtype=np.float64)

    def columns(self, columns: Array) -> tuple[Array, float]:
        """Whiten columns of shape (channels * n, k), and return also the log determinant of the covariance."""
        gains, shares, total = self._filter
        return _filtered(columns, gains, shares), total

    def of_channel(self, columns: Array, channel: int) -> Array:
        """Whiten columns that are zero outside one channel, from and to that channel's part of shape (n, k)."""
        gains, shares, _ = self._filter
        n = self.history.input_mm.size
        part = slice(channel * n, (channel + 1) * n)
        return _filtered(columns, gains[part], shares[part])

    def one(self, column: Array) -> Array:
        """Whiten a single column of shape (channels * n,)."""
        return self.columns(column[:, None])[0][:, 0]


def _filtered(columns: Array, gains: Array, shares: Array) -> Array:
    """Innovations of a Kalman filter (whitened values) of columns, shape (m, k)."""
    whole = np.ascontiguousarray(columns, dtype=np.float64)
    out = np.empty_like(whole)
    _innovations(whole, gains, shares, out)
    return out

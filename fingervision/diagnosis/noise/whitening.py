"""Whitening: convert correlated noise of unequal variance to unit white noise, by a Kalman filter (Kalman 1960)."""

from dataclasses import dataclass, field

import numpy as np

from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.domain.effect import Array, Flags, History
from fingervision.domain.loops import loop

SPREADS = np.concatenate([[0.0], np.geomspace(0.01, 1e4, 121)])
"""Spreads of the run offsets that are tried, relative to the noise."""
MIDLINE_FREE_MM = 1e3
"""Prior spread of the midline's constant: large enough to be free."""
GAINS = 5
"""Numbers a sample that the filter needs (`whitening.c`)."""

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
    runs_scatter_mm : float
        Largest standard deviation of random offsets between runs.
    """

    history: History
    noises: tuple[Noise, ...]
    aside: Flags
    input_mm: Array
    input_samples: float
    passing_mm: Array
    drawing: Array | None = None
    runs_scatter_mm: float = np.inf
    _filter: tuple[Array, Array, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Compute the filter's gains, which no column changes: every prediction of a search is whitened by them."""
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
        """Contribution (mm) of a lasting error of the input to each sample of a channel; shape (n,)."""
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


@dataclass(frozen=True, slots=True, eq=False)
class RunOffsets:
    """Nuisance parameters of every explanation: offsets of runs, constant of the midline, dimensions of the drawing.

    Re-zeroing is a zero-mean random effect per channel; the midline's constant is free; an uncertain dimension of the
    drawing is a random effect with its stated uncertainty.

    Parameters
    ----------
    design : ndarray of float, shape (m, columns)
        Whitened columns: one per run and channel, then the midline's constant, then the drawing's uncertain dimensions.
    channels : int
        Number of channels: gap, then midline and force if measured.
    runs : int
        Number of runs.
    midline : bool
        Whether the second channel is the midline, whose constant is free.
    scales_mm : tuple of float
        Noise of each channel.
    drawn : int
        Number of uncertain dimensions of the drawing.
    most_mm : float
        Largest spread of the runs' offsets that is considered.
    """

    design: Array
    gram: Array
    channels: int
    runs: int
    midline: bool
    scales_mm: tuple[float, ...]
    drawn: int = 0
    most_mm: float = np.inf
    _metrics: dict[tuple[float, ...], Array] = field(default_factory=dict, init=False, repr=False)
    _by_spread: list[tuple[Array, Array, Array]] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        """Tabulate for each channel, over the possible spreads of run offsets, what does not depend on the residual.

        These are the runs' weights, the share of each run's squared mean that an offset absorbs, and the penalty.
        """
        for channel, scale in enumerate(self.scales_mm):
            z = np.maximum(np.diag(self.gram)[channel * self.runs : (channel + 1) * self.runs], 1e-12)
            spread = np.minimum(scale * SPREADS, self.most_mm)[:, None] ** 2 * z
            penalty = np.sum(np.log1p(spread), axis=1) + 2.0 * np.log1p(SPREADS**2)
            self._by_spread.append((z, z * spread / (1.0 + spread), penalty))

    @classmethod
    def of(cls, whitener: Whitener) -> "RunOffsets":
        """Build the columns of the nuisance parameters for a whitener."""
        history, channels = whitener.history, len(whitener.noises)
        n, runs = history.input_mm.size, len(history.runs)
        free = int(history.both_edges)
        columns = np.zeros((channels * n, channels * runs + free))
        for channel in range(channels):
            for index, run in enumerate(history.runs):
                columns[channel * n + run.start : channel * n + run.stop, channel * runs + index] = 1.0
        if free:
            columns[n : 2 * n, -1] = 1.0
        drawn = 0 if whitener.drawing is None else whitener.drawing.shape[1]
        if whitener.drawing is not None:
            columns = np.hstack([columns, whitener.drawing])
        design = whitener.columns(columns)[0]
        scales = tuple(noise.total_mm for noise in whitener.noises)
        return cls(design, design.T @ design, channels, runs, bool(free), scales, drawn, whitener.runs_scatter_mm)

    def metric(self, sigma_mm: tuple[float, ...]) -> Array:
        """Return G such that r^T r - (Z^T r)^T G (Z^T r) is the squared length of r with the run offsets fitted."""
        known = self._metrics.get(sigma_mm)
        if known is not None:
            return known
        prior = [max(sigma_mm[channel], 1e-9) for channel in range(self.channels) for _ in range(self.runs)]
        prior += [MIDLINE_FREE_MM] * int(self.midline) + [1.0] * self.drawn
        found = np.asarray(np.linalg.inv(self.gram + np.diag(1.0 / np.array(prior) ** 2)), dtype=np.float64)
        # Spreads come from a grid, and with one run there is only one: the searches ask for the same again and again.
        found.setflags(write=False)
        self._metrics[sigma_mm] = found
        return found

    def squared(self, whitened: Array, metric: Array) -> float:
        """Squared length of a whitened column after the run offsets were fitted with a given metric."""
        shared = self.design.T @ whitened
        return float(whitened @ whitened - shared @ metric @ shared)

    def spread(self, residual: Array) -> tuple[tuple[float, ...], float]:
        """Estimate the spreads of the run offsets from a whitened residual by marginal likelihood.

        A half-Cauchy prior with the scale of one edge's noise (Gelman 2006) prevents that, for two runs, every common
        offset is attributed to scatter. With one run, the spread of the run offsets is zero.

        Returns
        -------
        sigma_mm : tuple of float
            Spread for each channel.
        penalty : float
            -2 log of determinant and prior, to be added to chi-square.
        """
        if self.runs == 1:
            return (0.0,) * self.channels, 0.0
        out, total = [], 0.0
        for scale, determinant, gain in self._tried(residual):
            best = int(np.argmin(determinant - gain))
            out.append(min(scale * float(SPREADS[best]), self.most_mm))
            total += float(determinant[best])
        return tuple(out), total

    def doubt(self, residual: Array) -> float:
        """-2 log of the ratio of a residual's probability over all spreads to that at the best spread.

        The value is added to a score.

        A few runs hardly determine the spread of their offsets; with this term, parameters that act like an offset have
        Student's tails.
        """
        if self.runs == 1:
            return 0.0
        width = np.gradient(SPREADS)
        total = 0.0
        for _, determinant, gain in self._tried(residual):
            cost = determinant - gain
            total -= 2.0 * float(np.log(np.sum(width * np.exp(-0.5 * (cost - cost.min())))))
        return total

    def drawn_spread(self, residual: Array, rng: np.random.Generator) -> tuple[float, ...]:
        """Draw the spread of the run offsets (mm) for each channel from its posterior given a residual.

        A few runs leave the spread of their offsets very uncertain.
        """
        width = np.gradient(SPREADS)
        out = []
        for scale, determinant, gain in self._tried(residual):
            cost = determinant - gain
            weight = width * np.exp(-0.5 * (cost - cost.min()))
            out.append(scale * float(rng.choice(SPREADS, p=weight / weight.sum())))
        return tuple(out)

    def _tried(self, residual: Array) -> list[tuple[float, Array, Array]]:
        """Scale of each channel, and for all tried spreads the penalty and the reduction of chi-square by offsets."""
        shares = self.design.T @ residual
        if self.drawn:
            # What the drawing's numbers explain is no scatter between runs.
            inner = self.gram[-self.drawn :, -self.drawn :] + np.eye(self.drawn)
            shares = shares - self.gram[:, -self.drawn :] @ np.linalg.solve(inner, shares[-self.drawn :])
        found = []
        for channel, (z, weight, penalty) in enumerate(self._by_spread):
            mean = shares[channel * self.runs : (channel + 1) * self.runs] / z
            if channel == 1 and self.midline:
                mean = mean - np.sum(mean * z) / np.sum(z)
            found.append((self.scales_mm[channel], penalty, weight @ mean**2))
        return found

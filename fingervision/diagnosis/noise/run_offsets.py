"""Offsets of the runs: nuisance parameters of every explanation, which are fitted as random effects."""

from dataclasses import dataclass, field

import numpy as np

from fingervision.diagnosis.noise.whitening import Whitener
from fingervision.domain.effect import Array

SPREADS = np.concatenate([[0.0], np.geomspace(0.01, 1e4, 121)])
"""Spreads of the run offsets that are tried, relative to the noise."""
WIDTHS = np.gradient(SPREADS)
"""Width of the interval that each of these spreads represents."""
MIDLINE_FREE_MM = 1e3
"""Prior spread of the midline's constant: large enough to be free."""


@dataclass(frozen=True, slots=True, eq=False)
class RunOffsets:
    """Nuisance parameters of every explanation: re-zeroing between runs, constant of the midline, the drawing.

    Offsets by re-zeroing are zero-mean random effects of each channel, and the constant of the midline is a free
    parameter. The errors of uncertain dimensions in the drawing are random effects with their stated uncertainties.

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
    """

    design: Array
    gram: Array
    channels: int
    runs: int
    midline: bool
    scales_mm: tuple[float, ...]
    drawn: int = 0
    _metrics: dict[tuple[float, ...], Array] = field(default_factory=dict, init=False, repr=False)
    _by_spread: list[tuple[Array, Array, Array]] = field(default_factory=list, init=False, repr=False)
    _beside_drawn: list[Array] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        """Tabulate, for each channel and each spread, the quantities that do not depend on the residual.

        The precomputed tables contain the weights of the runs, the part of each run's squared mean that an offset
        absorbs, and the penalty.
        """
        for channel, scale in enumerate(self.scales_mm):
            z = np.maximum(np.diag(self.gram)[channel * self.runs : (channel + 1) * self.runs], 1e-12)
            spread = (scale * SPREADS)[:, None] ** 2 * z
            penalty = np.sum(np.log1p(spread), axis=1) + 2.0 * np.log1p(SPREADS**2)
            self._by_spread.append((z, z * spread / (1.0 + spread), penalty))
        if self.drawn:
            inner = self.gram[-self.drawn :, -self.drawn :] + np.eye(self.drawn)
            apart = np.linalg.solve(inner, self.gram[-self.drawn :]).T
            self._beside_drawn.append(np.asarray(apart, dtype=np.float64))

    @classmethod
    def of(cls, whitener: Whitener) -> "RunOffsets":
        """Build the columns for a whitener."""
        history, channels = whitener.history, len(whitener.noises)
        n, runs = history.input_mm.size, len(history.runs)
        free = int(history.both_edges)
        columns = np.zeros((channels * n, channels * runs + free))
        for channel in range(channels):
            for index, run in enumerate(history.runs):
                columns[channel * n + run.start : channel * n + run.stop, channel * runs + index] = 1.0
        if free:
            columns[n : 2 * n, -1] = 1.0
        drawn = whitener.random_mm.shape[1]
        design = whitener.columns(np.hstack([columns, whitener.random_mm]))[0]
        scales = tuple(noise.total_mm for noise in whitener.noises)
        return cls(design, design.T @ design, channels, runs, bool(free), scales, drawn)

    def metric(self, sigma_mm: tuple[float, ...]) -> Array:
        """Return G such that r' r - (Z' r)' G (Z' r) is the squared length of r after a fit of the offsets Z."""
        known = self._metrics.get(sigma_mm)
        if known is not None:
            return known
        prior = [max(sigma_mm[channel], 1e-9) for channel in range(self.channels) for _ in range(self.runs)]
        prior += [MIDLINE_FREE_MM] * int(self.midline) + [1.0] * self.drawn
        normal = self.gram + np.diag(1.0 / np.array(prior) ** 2)
        # The matrix is scaled to a unit diagonal before inversion. Without scaling, rounding made the square of a
        # residual negative if it was a million times the noise.
        length = np.sqrt(np.diag(normal))
        found = np.asarray(
            np.linalg.inv(normal / np.outer(length, length)) / np.outer(length, length), dtype=np.float64
        )
        # Results are cached, because spreads come from a grid, with one run even a single spread, and searches request
        # the same ones repeatedly.
        found.setflags(write=False)
        self._metrics[sigma_mm] = found
        return found

    def beside(self, whitened: Array, metric: Array) -> Array:
        """Parts of whitened columns that the offsets of a metric leave; shape of the columns."""
        return np.asarray(whitened - self.design @ (metric @ (self.design.T @ whitened)))

    def squared(self, whitened: Array, metric: Array) -> float:
        """Squared length of a whitened column, with the offsets of a metric fitted."""
        shared = self.design.T @ whitened
        return float(whitened @ whitened - shared @ metric @ shared)

    def spread(self, residual: Array) -> tuple[tuple[float, ...], float]:
        """Estimate the spreads from a whitened residual by marginal likelihood.

        Without a prior, every common offset of two runs would be attributed to scatter; a half-Cauchy prior with the
        scale of one edge's noise (Gelman 2006) prevents this. For a single run, the spread of the offsets is zero.

        Returns
        -------
        sigma_mm : tuple of float
            Spread for each channel.
        penalty : float
            -2 log of determinant and prior, to be added to chi-square.
        """
        if self.runs == 1:
            return (0.0,) * self.channels, 0.0
        return self._likeliest(self._tried(residual))

    def spread_and_doubt(self, residual: Array) -> tuple[tuple[float, ...], float, float]:
        """Estimate the spreads of the run offsets as `spread` does, with a penalty for their uncertainty.

        A few runs hardly determine the spread of their offsets; with a penalty for this uncertainty, parameters that
        act like an offset have Student's tails.

        Returns
        -------
        sigma_mm, penalty
            As `spread` returns them.
        doubt : float
            -2 log of the ratio of the residual's probability over all spreads to that at the best spread, to be added
            to a score.
        """
        if self.runs == 1:
            return (0.0,) * self.channels, 0.0, 0.0
        tried, doubt = self._tried(residual), 0.0
        for _, determinant, gain in tried:
            cost = determinant - gain
            doubt -= 2.0 * float(np.log(np.sum(WIDTHS * np.exp(-0.5 * (cost - cost.min())))))
        return *self._likeliest(tried), doubt

    def _likeliest(self, tried: list[tuple[float, Array, Array]]) -> tuple[tuple[float, ...], float]:
        """The most probable spread of the run offsets of each channel, and the penalty."""
        out, total = [], 0.0
        for scale, determinant, gain in tried:
            best = int(np.argmin(determinant - gain))
            out.append(scale * float(SPREADS[best]))
            total += float(determinant[best])
        return tuple(out), total

    def drawn_spread(self, residual: Array, rng: np.random.Generator) -> tuple[float, ...]:
        """Draw the spreads from their posterior given a residual; one per channel, in mm.

        With a few runs only, the spread of the offsets is very uncertain.
        """
        out = []
        for scale, determinant, gain in self._tried(residual):
            cost = determinant - gain
            weight = WIDTHS * np.exp(-0.5 * (cost - cost.min()))
            out.append(scale * float(rng.choice(SPREADS, p=weight / weight.sum())))
        return tuple(out)

    def _tried(self, residual: Array) -> list[tuple[float, Array, Array]]:
        """Scale of each channel; for all spreads, the penalty and the reduction of chi-square due to offsets."""
        shares = self.design.T @ residual
        for columns in self._beside_drawn:
            # The part that the drawing's uncertain dimensions explain is not scatter between runs.
            shares = shares - columns @ shares[-self.drawn :]
        found = []
        for channel, (z, weight, penalty) in enumerate(self._by_spread):
            mean = shares[channel * self.runs : (channel + 1) * self.runs] / z
            if channel == 1 and self.midline:
                mean = mean - np.sum(mean * z) / np.sum(z)
            found.append((self.scales_mm[channel], penalty, weight @ mean**2))
        return found


@dataclass(frozen=True, slots=True, eq=False)
class WhitenedColumns:
    """Whitened columns, of which each may explain a residual beside the offsets of the runs.

    Parameters
    ----------
    columns : ndarray of float, shape (m, k)
        The columns.
    offsets : RunOffsets
        The offsets.
    """

    columns: Array
    offsets: RunOffsets
    squares: Array = field(init=False, repr=False)
    _shared: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Compute once what every step of a search needs: squared lengths, and products with the offsets."""
        object.__setattr__(self, "squares", np.einsum("ij,ij->j", self.columns, self.columns))
        object.__setattr__(self, "_shared", self.offsets.design.T @ self.columns)

    def lengths(self, metric: Array) -> Array:
        """Squared lengths of the parts of the columns that the offsets of a metric leave; shape (k,)."""
        return np.asarray(self.squares - np.einsum("ij,ij->j", self._shared, metric @ self._shared))

    def against(self, residual: Array, metric: Array, beside: Array) -> tuple[Array, Array]:
        """Products of the columns with a residual, and their squared lengths, beside offsets and further columns.

        Parameters
        ----------
        residual : ndarray of float, shape (m,)
            Whitened residual.
        metric : ndarray of float
            Metric of the offsets.
        beside : ndarray of float, shape (m, p)
            Columns that are fitted at the same time.

        Returns
        -------
        dot, norm : ndarray of float, shape (k,)
            Their quotient is the fitted coefficient of a column alone, and `dot**2 / norm` its reduction of chi-square.
        """
        dot, norm = self.columns.T @ self.offsets.beside(residual, metric), self.lengths(metric)
        if beside.shape[1]:
            moved = self.offsets.beside(beside, metric)
            cross, inverse = moved.T @ self.columns, np.linalg.pinv(beside.T @ moved)
            dot = dot - cross.T @ (inverse @ (moved.T @ residual))
            norm = norm - np.einsum("ij,ij->j", cross, inverse @ cross)
        return np.asarray(dot), np.asarray(norm)

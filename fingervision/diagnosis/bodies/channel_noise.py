"""Joint noise of many channels: the part shared by all channels (such as camera shake), and correlation in time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_KNOTS = 8
"""Number of pieces of the spline over the input, whose fit is not counted as noise, whatever its cause."""
_FEWEST_A_PIECE = 12
"""Least number of rows in a piece: the piece's coefficient then absorbs at most a twelfth of their noise."""
_OUTLIER = 5.0
"""Standard deviations from the spline beyond which a row is excluded: 1 in 2 million by chance."""
_MOST_CORRELATED = 0.97
"""Largest correlation of neighbouring rows: noise with a larger correlation is a drift over some 30 rows, and the sum
of its correlations diverges."""
_RANK = 1e-9
"""Smallest variance, relative to the largest, of the scaled channels: a smaller variance means that a channel is
determined exactly by the other channels."""


@dataclass(frozen=True, slots=True, eq=False)
class ChannelNoise:
    """Whitening transformation of all channels: afterwards, the noise has unit variance and is independent.

    Parameters
    ----------
    mixing : ndarray of float, shape (channels, k)
        Transforms the channels of a row to k independent components.
    correlation : ndarray of float, shape (k,)
        Correlation between neighbouring rows of a run, for each component.
    runs : tuple of slice
        Rows of each run.
    kept : ndarray of bool, shape (n,)
        Rows that are not outliers.
    sd : ndarray of float, shape (channels,)
        Standard deviation of one reading of each channel.
    degrees : int
        Degrees of freedom of the estimate.
    """

    mixing: Array
    correlation: Array
    runs: tuple[slice, ...]
    kept: Flags
    sd: Array
    degrees: int

    def whitened(self, rows: Array) -> Array:
        """Whiten signals of all channels.

        Parameters
        ----------
        rows : ndarray of float, shape (n, channels)
            A signal in all channels.

        Returns
        -------
        ndarray of float, shape (n * k,)
            The whitened signal; excluded rows are zero.
        """
        mixed = np.where(self.kept[:, None], rows, 0.0) @ self.mixing
        out = np.empty_like(mixed)
        root = np.sqrt(1.0 - self.correlation**2)
        for run in self.runs:
            out[run] = mixed[run] / root
            out[run][1:] -= self.correlation * mixed[run][:-1] / root
            out[run][:1] *= root
        return np.asarray(np.where(self.kept[:, None], out, 0.0).ravel())


def channel_noise(
    residual: Array, input_mm: Array, runs: tuple[slice, ...], floors: Array, *, timed: bool
) -> ChannelNoise:
    """Estimate the noise of all channels from the residuals about smooth curves over the input.

    Parameters
    ----------
    residual : ndarray of float, shape (n, channels)
        Measured minus predicted values.
    input_mm : ndarray of float, shape (n,)
        Inputs.
    runs : tuple of slice
        Rows of each run.
    floors : ndarray of float, shape (channels,)
        Smallest noise of each channel: the uncertainty stated with the readings, or the rounding of their last digit.
    timed : bool
        Whether the rows are in order of time, so that neighbouring rows may have correlated noise.
    """
    curves = _curves(input_mm, runs, timed=timed)
    kept = np.ones(input_mm.size, dtype=bool)
    for _ in range(3):
        fitted = curves @ np.linalg.lstsq(curves[kept], residual[kept], rcond=None)[0]
        rest = residual - fitted
        spread = np.maximum(1.4826 * np.median(np.abs(rest[kept]), axis=0), 1e-12)
        aside = np.any(np.abs(rest) > _OUTLIER * np.maximum(spread, floors), axis=1)
        if np.array_equal(kept, ~aside):
            break
        kept = ~aside
    degrees = max(int(kept.sum()) - curves.shape[1], 1)
    covariance = rest[kept].T @ rest[kept] / degrees
    short = np.maximum(floors**2 - np.diag(covariance), 0.0)
    covariance = covariance + np.diag(short)
    sd = np.sqrt(np.maximum(np.diag(covariance), 1e-24))
    values, vectors = np.linalg.eigh(covariance / np.outer(sd, sd))
    used = values > _RANK * values.max()
    mixing = (vectors[:, used] / np.sqrt(values[used])) / sd[:, None]
    correlation = np.zeros(int(used.sum()))
    if timed:
        mixed = np.where(kept[:, None], rest @ mixing, 0.0)
        products, squares, pairs = np.zeros(correlation.size), np.zeros(correlation.size), 0
        for run in runs:
            products += np.sum(mixed[run][1:] * mixed[run][:-1], axis=0)
            squares += np.sum(mixed[run] ** 2, axis=0)
            pairs += max(run.stop - run.start - 1, 0)
        found = products / np.maximum(squares, 1e-300)
        # A fitted curve absorbs some of the slow noise. Correct the bias of the correlation rho, (1 + 3 rho) / n per
        # constant (Marriott and Pope).
        found += (1.0 + 3.0 * found) * curves.shape[1] / max(2 * pairs, 1)
        # A correlation that could be due to chance is set to zero: an error of 2 / sqrt(n) has no visible effect.
        correlation = np.where(found > 2.0 / np.sqrt(max(pairs, 1)), np.clip(found, 0.0, _MOST_CORRELATED), 0.0)
    return ChannelNoise(mixing, correlation, runs, kept, sd, degrees)


def _curves(input_mm: Array, runs: tuple[slice, ...], *, timed: bool) -> Array:
    """Regressors of the curves: cubic splines over the input, one constant per run, and the direction of motion."""
    low, high = float(input_mm.min()), float(input_mm.max())
    pieces = int(np.clip(input_mm.size // _FEWEST_A_PIECE, 1, _KNOTS))
    inner = np.linspace(low, high, pieces + 1)
    knots = np.concatenate([[low] * 3, inner, [high] * 3])
    columns = [BSpline.design_matrix(np.clip(input_mm, low, high), knots, 3).toarray()]
    for run in runs[1:]:
        own = np.zeros((input_mm.size, 1))
        own[run] = 1.0
        columns.append(own)
    if timed:
        way = np.concatenate([np.sign(np.gradient(input_mm[run])) if run.stop - run.start > 1 else np.zeros(1)
                              for run in runs])  # fmt: skip
        if np.ptp(way) > 0.0:
            columns.append(way[:, None])
    return np.hstack(columns)

"""Noise of one channel: white plus a first-order autoregression, estimated where slow structure cannot reach it."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from fingervision.domain.effect import Array, Flags

SLOW = 0.04
"""Cycles per sample below which structure of the gripper may hide."""
LINE = 9.0
"""A periodogram value this many times its expectation is a line, not noise."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of the white and the correlated part, and the correlation of neighbouring samples."""

    white_mm: float
    correlated_mm: float
    correlation: float

    @property
    def total_mm(self) -> float:
        """Standard deviation of one sample."""
        return float(np.hypot(self.white_mm, self.correlated_mm))


def gate(residual: Array, runs: tuple[slice, ...], ordered: bool, sigmas: float | None) -> Flags:
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
        # A real reversal moves neighbours too; an outlier stands alone or in pairs.
        out = np.abs(rest) > sigmas * sigma
        for i in range(2, residual.size - 2):
            if ordered and out[i - 2 : i + 3].sum() >= 4:
                out[i - 2 : i + 3] = False
    return out


def estimate_noise(
    residual: Array, runs: tuple[slice, ...], rate_hz: float | None, aside: Flags, floor_mm: float, degrees: int
) -> Noise:
    """Fit the noise to a residual by Whittle's likelihood (Whittle 1953), above 1 Hz or a 25th of the sample rate.

    Parameters
    ----------
    residual : ndarray of float, shape (n,)
        Measured minus predicted.
    runs : tuple of slice
        Samples of each run.
    rate_hz : float or None
        Sample rate; None without times: the noise is then white.
    aside : ndarray of bool, shape (n,)
        Outliers.
    floor_mm : float
        The measurement's own random part.
    degrees : int
        Parameters that were fitted.
    """
    kept = residual[~aside]
    if rate_hz is None:
        spread = float(np.sqrt(np.sum((kept - np.median(kept)) ** 2) / max(1, kept.size - 1 - degrees)))
        return Noise(max(spread, floor_mm, 1e-9), 0.0, 0.0)
    angles, powers = [], []
    for run in runs:
        values, bad = residual[run].copy(), aside[run]
        count = values.size
        if count < 24 or bad.all():
            continue
        good = np.flatnonzero(~bad)
        values[bad] = np.interp(np.flatnonzero(bad), good, values[good])
        line = np.polynomial.Polynomial.fit(np.arange(count), values, 1)
        taper = np.hanning(count + 2)[1:-1]
        power = np.abs(np.fft.rfft((values - line(np.arange(count))) * taper)) ** 2 / np.sum(taper**2)
        frequency = np.fft.rfftfreq(count)
        used = frequency > max(min(1.0 / rate_hz, SLOW), 2.5 / count)
        angles.append(2.0 * np.pi * frequency[used])
        powers.append(power[used])
    angle, power = np.concatenate(angles), np.concatenate(powers)
    start = float(np.median(power) / 0.6931)
    use = np.ones(power.size, dtype=bool)

    def spectrum(p: Array) -> Array:
        phi = 0.97 / (1.0 + np.exp(-p[2]))
        shock = np.exp(p[1]) * (1.0 - phi**2)
        return np.asarray(np.exp(p[0]) + shock / (1.0 + phi**2 - 2.0 * phi * np.cos(angle)), dtype=np.float64)

    def cost(p: Array) -> float:
        expected = spectrum(p)[use]
        # A weak pull of the correlation towards the middle keeps short records from running to a limit.
        return float(np.sum(np.log(expected) + power[use] / expected) + 0.05 * p[2] ** 2 + 0.01 * (p[0] - p[1]) ** 2)

    best = None
    for _ in range(3):
        first = [np.array([np.log(0.6 * start), np.log(0.6 * start), p]) for p in (-1.0, 1.5)]
        tries = [
            minimize(cost, begin, method="Nelder-Mead", options={"maxiter": 200, "xatol": 0.02, "fatol": 0.02})
            for begin in (first if best is None else [best])
        ]
        best = min(tries, key=lambda found: float(found.fun)).x
        keep = power < LINE * spectrum(best)
        if np.array_equal(keep, use):
            break
        use = keep
    assert best is not None  # noqa: S101 - the loop runs
    white, correlated = float(np.exp(0.5 * best[0])), float(np.exp(0.5 * best[1]))
    phi = 0.97 / (1.0 + float(np.exp(-best[2])))
    scale = max(1.0, floor_mm / max(1e-12, float(np.hypot(white, correlated))))
    return Noise(max(scale * white, 1e-9), scale * correlated, phi)


def pooled_short_noise(
    residuals_mm: list[Array], runs: tuple[slice, ...], aside: list[Flags], floors_mm: list[float], *, explained: bool
) -> tuple[Noise, ...]:
    """Fit first-order autoregressions to short records by restricted likelihood (Patterson & Thompson 1971).

    Too few samples for a spectrum, and taken for white they would let every slow effect claim what is noise. The
    channels are drawn from the same pictures, so one correlation serves them all: its posterior mean under a flat
    prior. Before anything is explained, the channel that is correlated least gives it, since an effect can only add.

    Parameters
    ----------
    residuals_mm, aside : list of ndarray, shape (n,)
        By channel.
    runs : tuple of slice
        Samples of each run; each has a straight line of its own taken out.
    floors_mm : list of float
        The measurement's own random part, by channel.
    explained : bool
        Whether effects have been taken out.
    """
    grid = np.linspace(0.0, 0.95, 39)
    cost = np.empty((len(residuals_mm), grid.size))
    spread = np.empty_like(cost)
    for channel, (residual, out) in enumerate(zip(residuals_mm, aside, strict=True)):
        for k, rho in enumerate(grid):
            total, rows, determinants = 0.0, 0, 0.0
            for run in runs:
                place = np.flatnonzero(~out[run])
                if place.size < 4:
                    continue
                line = np.stack([np.ones(place.size), place - place.mean(), residual[run][place]], axis=1)
                keep = rho ** np.diff(place, prepend=place[0] - 1000)
                root = np.sqrt(1.0 - keep**2)
                white = line / root[:, None]
                white[1:] -= (keep / root)[1:, None] * line[:-1]
                normal = white[:, :2].T @ white[:, :2]
                rest = white[:, 2] - white[:, :2] @ np.linalg.solve(normal, white[:, :2].T @ white[:, 2])
                total += float(rest @ rest)
                rows += place.size - 2
                determinants += 2.0 * float(np.sum(np.log(root))) + float(np.log(np.linalg.det(normal)))
            rows = max(rows, 1)
            spread[channel, k] = np.sqrt(total / rows)
            cost[channel, k] = rows * np.log(max(total, 1e-300) / rows) + determinants
    weight = np.exp(-0.5 * (cost - cost.min(axis=1, keepdims=True)))
    if explained:
        weight = np.prod(weight, axis=0, keepdims=True)
    rho = float(np.min(weight @ grid / weight.sum(axis=1)))
    scales = [float(np.interp(rho, grid, row)) for row in spread]
    return tuple(
        Noise(1e-3 * scale, scale, max(rho, 1e-3))
        for scale in (max(s, floor, 1e-9) for s, floor in zip(scales, floors_mm, strict=True))
    )

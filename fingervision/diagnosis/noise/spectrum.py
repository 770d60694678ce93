"""Noise of long records by Whittle's likelihood (Whittle 1953), from frequencies above those of slow structure."""

from functools import lru_cache

import numpy as np

from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.domain.effect import Array, Flags

SLOW, SLOW_EXPLAINED = 0.04, 0.02
"""Frequencies, in cycles per sample, below which unexplained structure may be present, before effects are found, and
after."""
TAPERED = 1.94
"""Number of neighbouring ordinates that count as one, because Hann's taper correlates them."""
CORRELATIONS = tuple(float(phi) for phi in np.linspace(0.05, 0.95, 46))
"""Correlations of neighbouring samples that are tried, as dense as a record of 2500 samples can distinguish."""
KINDS = (slice(0, 1), slice(1, 1 + len(CORRELATIONS)), slice(1 + len(CORRELATIONS), None))
"""White noise, autoregressions, and their sums, among all forms of the spectrum that are tried."""
SLOWEST = 2.0 * np.pi * np.array([0.01])
"""Frequency at which the effects of a gripper have most of their power: about one period in a hundred samples."""
LINE = 9.0
"""Ratio of a periodogram value to its expectation above which it is a spectral line, not noise."""
LEAST_RUN = 24
"""Number of samples below which a run is left out."""


def noise_by_spectrum(
    residuals_mm: list[Array],
    runs: tuple[slice, ...],
    rate_hz: float,
    aside: list[Flags],
    floors_mm: list[float],
    *,
    explained: bool,
) -> tuple[Noise, ...]:
    """Fit the noise of channels whose spectra have the same shape, each channel with its own level.

    Parameters
    ----------
    residuals_mm, aside : list of ndarray, shape (n,)
        Measured minus predicted values, and outliers, for each channel.
    runs : tuple of slice
        Samples of each run.
    rate_hz : float
        Sample rate; frequencies below 1 Hz are not used, if `SLOW` is higher than that.
    floors_mm : list of float
        Random uncertainty of the measurement itself, for each channel.
    explained : bool
        Whether effects have been subtracted.
    """
    slow = min(1.0 / rate_hz, SLOW_EXPLAINED if explained else SLOW)
    angle = np.concatenate([angles(run.stop - run.start, slow) for run in runs])
    found = [powers(residual, runs, out, slow) for residual, out in zip(residuals_mm, aside, strict=True)]
    use = [np.ones(angle.size, dtype=bool) for _ in found]
    for _ in range(3):
        variances, share, phi, doubt = _likeliest(angle, found, use)
        expected = shape(angle, share, phi)
        keep = [power < LINE * variance * expected for power, variance in zip(found, variances, strict=True)]
        if all(np.array_equal(new, old) for new, old in zip(keep, use, strict=True)):
            break
        use = keep
    scales = [max(float(np.sqrt(v)), floor, 1e-9) for v, floor in zip(variances, floors_mm, strict=True)]
    white, correlated = float(np.sqrt(1.0 - share)), float(np.sqrt(share))
    return tuple(Noise(scale * white, scale * correlated, phi, doubt) for scale in scales)


def _used(count: int, slow: float) -> Flags:
    frequency = np.fft.rfftfreq(count)
    return np.asarray((frequency > max(slow, 2.5 / count)) & (count >= LEAST_RUN))


def angles(count: int, slow: float) -> Array:
    """Angles per sample of the frequencies of a run of `count` samples that are used; those above `slow`."""
    return np.asarray(2.0 * np.pi * np.fft.rfftfreq(count)[_used(count, slow)])


def powers(residual: Array, runs: tuple[slice, ...], aside: Flags, slow: float) -> Array:
    """Periodogram of each run after subtraction of a straight line, run after run; outliers are interpolated."""
    found = []
    for run in runs:
        values, bad = residual[run].copy(), aside[run]
        count = values.size
        good = np.flatnonzero(~bad)
        if good.size:
            values[bad] = np.interp(np.flatnonzero(bad), good, values[good])
        if count >= LEAST_RUN:
            line = np.polynomial.Polynomial.fit(np.arange(count), values, 1)
            taper = np.hanning(count + 2)[1:-1]
            power = np.abs(np.fft.rfft((values - line(np.arange(count))) * taper)) ** 2 / np.sum(taper**2)
            found.append(power[_used(count, slow)])
    return np.concatenate(found)


def shape(angle: Array, share: float, phi: float) -> Array:
    """Noise spectrum of unit variance, of which a share `share` has the correlation `phi` between neighbouring samples.

    The spectrum has shape (m,).
    """
    correlated = (1.0 - phi**2) / (1.0 + phi**2 - 2.0 * phi * np.cos(angle))
    return np.asarray(1.0 - share + share * correlated, dtype=np.float64)


def _likeliest(angle: Array, powers: list[Array], use: list[Flags]) -> tuple[list[float], float, float, float]:
    """Choose the most probable noise model: white noise, an autoregression, or the sum of both.

    A sum that is fitted to white noise can have a correlated part below the frequencies used, and then overstates the
    slow noise by a factor of three. White noise, an autoregression and their sum therefore have equal prior
    probabilities, and the posterior mean of the most probable model is returned.

    Returns
    -------
    variances : list of float
        Variance of one sample, for each channel.
    share, correlation : float
        Share of the correlated part in the variance, and correlation of its neighbouring samples.
    slow_doubt : float
        Standard uncertainty of the logarithm of the power at `SLOWEST`, over all kinds of noise.
    """
    tried, forms, log_forms = _forms(angle.tobytes())
    levels = [np.log(_variances(power, kept, forms)) for power, kept in zip(powers, use, strict=True)]
    costs = sum(kept.sum() * level + log_forms @ kept.astype(float) for kept, level in zip(use, levels, strict=True))
    slow = np.mean(levels, axis=0) + np.log([shape(SLOWEST, share, phi)[0] for share, phi in tried])
    found: list[tuple[float, float, float]] = []
    for kind in KINDS:
        own = costs[kind]
        weight = np.exp(-(own - own.min()) / TAPERED)
        share, phi = np.average(tried[kind], axis=0, weights=weight)
        found.append((-own.min() / TAPERED + float(np.log(np.mean(weight))), min(float(share), 1.0), float(phi)))
    _, share, phi = max(found)
    prior = np.concatenate([np.full(costs[kind].size, 1.0 / costs[kind].size) for kind in KINDS])
    likely = prior * np.exp(-(costs - costs.min()) / TAPERED)
    order = np.argsort(slow)
    reached = np.cumsum(likely[order]) / likely.sum()
    low, high = np.interp((0.159, 0.841), reached, slow[order])
    form = 1.0 / shape(angle, share, phi)[None]
    best = [float(_variances(power, kept, form)[0]) for power, kept in zip(powers, use, strict=True)]
    return best, share, max(phi, 1e-3), 0.5 * float(high - low)


@lru_cache(maxsize=2)
def _forms(angles: bytes) -> tuple[Array, Array, Array]:
    """Shares and correlations that are tried, one over each one's spectrum, and its logarithm; shape (k, m)."""
    angle = np.frombuffer(angles)
    mixed = [(share, phi) for share in np.linspace(0.1, 0.9, 9) for phi in CORRELATIONS]
    tried = np.array([(0.0, 0.0), *((1.0, phi) for phi in CORRELATIONS), *mixed])
    forms = np.array([shape(angle, share, phi) for share, phi in tried])
    return tried, 1.0 / forms, np.log(forms)


def _variances(power: Array, kept: Flags, inverse_forms: Array) -> Array:
    """Variance of one sample, for each form of the spectrum; shape (k,)."""
    return np.asarray(np.maximum(inverse_forms @ np.where(kept, power, 0.0) / max(1, kept.sum()), 1e-24))

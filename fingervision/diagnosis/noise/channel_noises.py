"""Noise of every channel, estimated from repeats, from stops of the stage, or from the residual's spectrum."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.noise.noise_model import LEAST_SHARE, Noise, white_noise
from fingervision.diagnosis.noise.replicates import PureError
from fingervision.diagnosis.noise.restricted_likelihood import noise_of_short_runs
from fingervision.domain.effect import Array, Flags, History
from fingervision.motion.recorded_input import standing_still

SLOW, SLOW_EXPLAINED = 0.04, 0.02
"""Frequencies, in cycles per sample, below which unexplained structure may be present, before effects are found, and
after."""
TAPERED = 1.94
"""Number of neighbouring ordinates that count as one, because Hann's taper correlates them."""
CORRELATIONS = tuple(float(phi) for phi in np.linspace(0.05, 0.95, 46))
"""Correlations of neighbouring samples that are tried, as dense as a record of 2500 samples can distinguish."""
SLOWEST = 2.0 * np.pi * np.array([0.01])
"""Frequency at which the effects of a gripper have most of their power: about one period in a hundred samples."""
BANDS = 512
"""Number of bands of equal width in which a spectrum that is tried counts as constant: at the largest correlation that
is tried, it changes over a tenth of a radian."""
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


def shape(angle: Array, share: Array | float, phi: Array | float) -> Array:
    """Noise spectrum of unit variance, of which a share `share` has the correlation `phi` between neighbouring samples.

    The spectrum has shape (m,), or (k, m) for shares and correlations of shape (k, 1).
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
    mixed = [(share, phi) for share in np.linspace(0.1, 0.9, 9) for phi in CORRELATIONS]
    kinds = ([(0.0, 0.0)], [(1.0, phi) for phi in CORRELATIONS], mixed)
    tried = np.array([each for kind in kinds for each in kind])
    # A spectrum hardly changes between neighbouring frequencies, and runs of equal length have the same ones.
    _, alike = np.unique(np.floor(angle * (BANDS / np.pi)), return_inverse=True)
    forms = shape(np.bincount(alike, angle) / np.bincount(alike), *tried.T[:, :, None])
    counts = [np.bincount(alike, kept) for kept in use]
    sums = [np.bincount(alike, power * kept) for power, kept in zip(powers, use, strict=True)]
    inverse, logarithm = 1.0 / forms, np.log(forms)
    levels = [np.log(np.maximum(inverse @ one / n.sum(), 1e-24)) for one, n in zip(sums, counts, strict=True)]
    costs = sum(n.sum() * level + logarithm @ n for n, level in zip(counts, levels, strict=True))
    slow = np.mean(levels, axis=0) + np.log(shape(SLOWEST, *tried.T))
    found: list[tuple[float, float, float]] = []
    begin = 0
    for kind in kinds:
        own = costs[begin : begin + len(kind)]
        begin += len(kind)
        weight = np.exp(-(own - own.min()) / TAPERED)
        share, phi = np.average(np.array(kind), axis=0, weights=weight)
        found.append((-own.min() / TAPERED + float(np.log(np.mean(weight))), min(float(share), 1.0), float(phi)))
    _, share, phi = max(found)
    prior = np.concatenate([np.full(len(kind), 1.0 / len(kind)) for kind in kinds])
    likely = prior * np.exp(-(costs - costs.min()) / TAPERED)
    order = np.argsort(slow)
    reached = np.cumsum(likely[order]) / likely.sum()
    low, high = np.interp((0.159, 0.841), reached, slow[order])
    flat = [power / shape(angle, share, phi) for power in powers]
    best = [max(float(np.mean(power[kept])), 1e-24) for power, kept in zip(flat, use, strict=True)]
    return best, share, max(phi, 1e-3), 0.5 * float(high - low)


FEWEST_STANDING = 60
"""Total number of samples at rest required to estimate the noise from them."""
SHORT_RUN = 60
"""Length of the longest run, in samples, below which its spectrum contains too little information on the noise."""


def channel_noises(
    history: History, parts: list[Array], aside: list[Flags], floors: list[float], degrees: int, *, explained: bool
) -> tuple[Noise, ...]:
    """Estimate every channel's noise; gap and midline come from the same pictures and have related noise.

    Parameters
    ----------
    history : History
        Runs and times.
    parts : list of ndarray of float, shape (n,)
        Residual of each channel.
    aside : list of ndarray of bool, shape (n,)
        Excluded rows of each channel.
    floors : list of float
        Smallest noise of each channel: the rounding of its last digit, or the stated uncertainty.
    degrees : int
        Number of fitted parameters.
    explained : bool
        Whether the residuals are those of an explanation.
    """
    if history.time_s is None:
        return tuple(
            white_noise(part, out, floor, degrees) for part, out, floor in zip(parts, aside, floors, strict=True)
        )
    rate_hz = 1.0 / history.sample_time_s
    together = 2 if history.both_edges and explained else 1
    groups = [slice(0, together), *(slice(k, k + 1) for k in range(together, len(parts)))]
    if max(run.stop - run.start for run in history.runs) < SHORT_RUN:
        return noise_of_short_runs(parts, history.runs, aside, floors, explained=explained)

    def over(stretches: tuple[slice, ...]) -> tuple[Noise, ...]:
        return tuple(
            noise
            for g in groups
            for noise in noise_by_spectrum(parts[g], stretches, rate_hz, aside[g], floors[g], explained=explained)
        )

    everywhere = over(history.runs)
    standing = () if explained else standing_still(history, LEAST_RUN)
    if sum(hold.stop - hold.start for hold in standing) < FEWEST_STANDING:
        return everywhere
    # Unexplained changes that follow the motion of the stage would count as noise; in holds of the stage they are
    # smaller.
    holds = over(standing)
    return holds if holds[0].total_mm < everywhere[0].total_mm else everywhere


def noises_of_repeats(errors: list[PureError], floors: list[float]) -> tuple[Noise, ...]:
    """Use the scatter of repeated readings as white noise, because readings seconds apart have independent errors.

    A variance with n degrees of freedom has the relative standard uncertainty sqrt(2 / n).
    """
    found = []
    for error, floor in zip(errors, floors, strict=True):
        sd_mm, doubt = max(error.sd_mm, floor, 1e-9), float(np.sqrt(2.0 / error.degrees))
        slow_mm = float(np.sqrt(1.0 - LEAST_SHARE)) * sd_mm if error.correlation > 0.0 else 0.0
        found.append(Noise(float(np.sqrt(sd_mm**2 - slow_mm**2)), slow_mm, error.correlation, doubt))
    return tuple(found)


CORRELATED = 10.0
"""Largest ratio of noise to its scatter from sample to sample: for an autoregression of 0.95 it is six."""
STRETCH = 20
"""Length, in samples, of stretches in which noise must be visible."""
WANDERING = 1.65
"""Largest ratio of noise to its scatter within such stretches: that of an autoregression of 0.9 (simulated; 1.3 for
0.8). With only the limit on the scatter from sample to sample, a third of a creep counted as noise."""
FEWEST_PAIRS = 20
"""Least number of readings with a second pass over their position: their scatter then has a relative uncertainty of a
sixth."""


def most_noise(residual_mm: Array, input_mm: Array, runs: tuple[slice, ...], digits_mm: float) -> float:
    """Largest standard deviation that the noise of a residual may have (mm); 0 if the runs are too short.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Residual of an explanation.
    input_mm : ndarray of float, shape (n,)
        Recorded input.
    runs : tuple of slice
        Rows of each run.
    digits_mm : float
        Standard deviation of the rounding of a reading.
    """
    limits = (
        (CORRELATED, _short_scatter(residual_mm, runs)),
        (WANDERING, _local_scatter(residual_mm, runs)),
        (1.0, _scatter_between_passes(residual_mm, input_mm, runs)),
    )
    return min((times * max(scatter, digits_mm) for times, scatter in limits if scatter is not None), default=0.0)


def _scatter_between_passes(residual_mm: Array, input_mm: Array, runs: tuple[slice, ...]) -> float | None:
    """Standard deviation of a reading, from differences of successive passes over a position; None without passes.

    A rough map of position errors looks like noise over time, but the return motion repeats it; stick-slip and other
    errors that depend on the direction are repeated by the next pass in the same direction. The smaller scatter is
    used. The mean difference of two passes may be hysteresis or drift and is removed. A value that is interpolated
    between two readings has at least half the variance of one reading, so that the result is not too small for noise
    that is independent between the passes.
    """
    ways = [[part + run.start for part in _passes(input_mm[run])] for run in runs]
    returns = [pair for one in ways for pair in pairwise(one)]
    same_way = [pair for one in ways for pair in zip(one, one[2:], strict=False)]
    found = [_scatter_of_pairs(residual_mm, input_mm, pairs) for pairs in (returns, same_way)]
    return min((scatter for scatter in found if scatter is not None), default=None)


def _scatter_of_pairs(
    residual_mm: Array, input_mm: Array, pairs: list[tuple[NDArray[np.int64], NDArray[np.int64]]]
) -> float | None:
    """Standard deviation of a reading from the differences of pairs of passes; None if the pairs share few readings."""
    found = []
    for there, back in pairs:
        if there.size and back.size:
            order = np.argsort(input_mm[back])
            low, high = input_mm[back[order[0]]], input_mm[back[order[-1]]]
            within = there[(input_mm[there] >= low) & (input_mm[there] <= high)]
            if within.size > 1:
                beside = np.interp(input_mm[within], input_mm[back[order]], residual_mm[back[order]])
                apart = residual_mm[within] - beside
                found.append(np.abs(apart - np.median(apart)))
    differences = np.concatenate(found) if found else np.zeros(0)
    # 0.6745 is the median of |x| for a normal distribution; a bump in a single pass enlarges only few differences.
    return float(np.median(differences) / 0.6745 / np.sqrt(1.5)) if differences.size >= FEWEST_PAIRS else None


def _passes(input_mm: Array) -> list[NDArray[np.int64]]:
    """Indices of the samples of each stretch over which the input moves in one direction, without its holds."""
    step = np.sign(np.diff(input_mm))
    moving = np.flatnonzero(step)
    turns = np.flatnonzero(np.diff(step[moving])) + 1
    return [part + 1 for part in np.split(moving, turns) if part.size > 1]


def _short_scatter(residual_mm: Array, runs: tuple[slice, ...]) -> float | None:
    """Standard deviation of white noise with the same median third difference; None for runs of a few samples."""
    differences = np.concatenate([np.diff(residual_mm[run], 3) for run in runs])
    # Third differences of white noise have 1 + 9 + 9 + 1 times its variance; 0.6745 is the median of |x| for a normal
    # distribution.
    return float(np.median(np.abs(differences))) / 0.6745 / float(np.sqrt(20.0)) if differences.size else None


def _local_scatter(residual_mm: Array, runs: tuple[slice, ...]) -> float | None:
    """Median standard deviation within stretches, each about its own mean; None without stretches.

    The median is used because an unexplained resonance or jump is large in a few stretches only.
    """
    found = []
    for run in runs:
        size = min(STRETCH, run.stop - run.start)
        if size > 1:
            begins = range(run.start, run.stop - size + 1, max(1, size // 2))
            found += [float(np.std(residual_mm[begin : begin + size], ddof=1)) for begin in begins]
    return float(np.median(found)) if found else None

"""Noise of the pictures in a residual that also contains errors of the recorded input with a known spectrum."""

import numpy as np

from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.diagnosis.noise.spectrum import (
    CORRELATIONS,
    LINE,
    SLOW_EXPLAINED,
    TAPERED,
    angles,
    powers,
    shape,
)
from fingervision.domain.effect import Array, Flags

FEWEST_POWERS = 20
"""Least number of values of the periodogram: the variance of white noise is then known to a third."""
ROUNDS = 12
"""Iterations for the variance: three to eight are needed if half of the residual's power is that of the input."""
LEAST_VARIANCE = 1e-6
"""Least variance of the noise, as a share of the residual's: below it the noise is not visible beside the input's
errors."""


def picture_noise(
    residual_mm: Array,
    errors_mm: Array,
    runs: tuple[slice, ...],
    rate_hz: float,
    aside: Flags,
    known: Noise,
    floor_mm: float,
) -> Noise:
    """Fit white noise, or an autoregression, in addition to errors of the recorded input (Whittle 1953).

    Errors of a smoothed record are alike over the windows of the smoothing, and average out over a stroke. A noise that
    is fitted to the whole residual takes them for an autoregression, which does not average out.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Residual of an explanation, in the gap.
    errors_mm : ndarray of float, shape (records, n)
        Errors of the gap in simulated repetitions of the record.
    runs : tuple of slice
        Samples of each run.
    rate_hz : float
        Sample rate.
    aside : ndarray of bool, shape (n,)
        Outliers.
    known : Noise
        Noise that was fitted to the whole residual; it is returned if the runs are too short for a spectrum.
    floor_mm : float
        Least noise.
    """
    slow, none = min(1.0 / rate_hz, SLOW_EXPLAINED), np.zeros(residual_mm.size, dtype=bool)
    angle = np.concatenate([angles(run.stop - run.start, slow) for run in runs])
    if angle.size < FEWEST_POWERS:
        return known
    power = powers(residual_mm, runs, aside, slow)
    of_input = np.mean([powers(error, runs, none, slow) for error in errors_mm], axis=0)
    kept = power < LINE * np.maximum(of_input, np.median(power))
    power, of_input, angle = power[kept], of_input[kept], angle[kept]
    best, noise = np.inf, known
    for share, phi in ((0.0, 0.0), *((1.0, phi) for phi in CORRELATIONS)):
        form = shape(angle, share, phi)
        variance = _variance(power, of_input, form)
        expected = variance * form + of_input
        # A correlation is one parameter more (Schwarz 1978); `TAPERED` neighbouring values count as one.
        cost = 2.0 * float(np.sum(np.log(expected) + power / expected)) / TAPERED + share * float(np.log(angle.size))
        if cost < best:
            best, sd = cost, max(float(np.sqrt(variance)), floor_mm, 1e-9)
            noise = Noise(sd * (1.0 - share), sd * share, max(phi, 1e-3), share * known.slow_doubt)
    return noise


def _variance(power: Array, of_input: Array, form: Array) -> float:
    """Most probable variance of a noise with the spectrum `form` beside a known power, by weighted least squares."""
    least = LEAST_VARIANCE * float(np.mean(power))
    variance = max(float(np.mean((power - of_input) / form)), 0.1 * float(np.mean(power / form)))
    for _ in range(ROUNDS):
        weight = (form / (variance * form + of_input)) ** 2
        variance = max(float(weight @ ((power - of_input) / form) / weight.sum()), least)
    return variance

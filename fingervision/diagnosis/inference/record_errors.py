"""Uncertainty of estimates from errors of the recorded input, by simulated repetition of the recording."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import derivatives, refit
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.inference.parameter_priors import START_VARIANCE
from fingervision.diagnosis.inference.posterior import settled
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.channel_noises import (
    CORRELATIONS,
    LINE,
    SLOW_EXPLAINED,
    TAPERED,
    angles,
    powers,
    shape,
)
from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.domain.effect import Array, Flags
from fingervision.motion.input_path import recorded
from fingervision.motion.local_polynomial_smoothing import SmoothedRecord, read_again
from fingervision.motion.recursion import recursion

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


RECORDS = 30
"""Number of simulated records: a standard deviation is then known to an eighth."""
MOST_ROWS = 40_000
"""Largest number of rows in all simulated records (a third of a second), and least number of records."""
FEWEST_RECORDS = 8
ASSUMED, LEAST_LEFT = 100, 0.05
"""Number of draws of the input's errors as the likelihood assumes them (their variance is then known to a seventh), and
least share of the variance of an estimate that is left to all other causes."""


def settled_with_records(
    data: Observations, problem: Problem, explanation: Explanation, rng: np.random.Generator
) -> tuple[Explanation, tuple[Point, ...]]:
    """Estimate the posterior of an explanation, with the contribution of errors of the recorded input.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    problem : Problem
        Estimation problem of the explanation.
    explanation : Explanation
        The explanation found.
    rng : numpy Generator
        Generator of random numbers for the draws and the simulated records.

    Returns
    -------
    explanation : Explanation
        Explanation with its values and their covariance.
    found : tuple of dict
        Draws from the posterior.
    """
    whitener, log, turning = problem.whitener, data.recorded.log, data.turning
    is_seen = log is not None or whitener.input_mm.any() or whitener.passing_mm.any()
    again = list(simulated_records(data, rng)) if is_seen or turning is not None else []
    counted = again if is_seen else []
    if (turning is None and log is None) or not explanation.names:
        best, found = settled(problem, explanation, rng)
        return with_record_errors(problem, best, counted), found
    alone = _with_picture_noise(data, problem, explanation, again)
    best, found = settled(alone, refit(alone, explanation), rng)
    # A residual above the assumed noise widens the intervals (Birge 1932).
    rows = max(1, problem.rows - best.free)
    best = replace(best, covariance=best.covariance * max(1.0, best.score / rows))
    best = with_record_errors(alone, best, counted, assumed_mm=_assumed(alone, rng))
    return problem.judged(best, best.values), found


def _with_picture_noise(
    data: Observations, problem: Problem, explanation: Explanation, again: list[MeasuringChain]
) -> Problem:
    """Return the problem with a noise of the gap that does not contain the errors of an encoder's record.

    The search takes these errors for an autoregression, so that it does not name effects for them. This noise is too
    large at low frequencies, where the errors of a smoothed record average out: of 57 simulated plays with encoders
    (`tests.benchmarks.world`, seed 302), all lay within 1.4 standard uncertainties.
    """
    turning, whitener, history = data.turning, problem.whitener, problem.chain.history
    if turning is None or history.time_s is None or data.repeats is not None:
        return problem
    n = history.input_mm.size
    seen = turning.apart * problem.chain.slope[:n]
    residual_mm = turning.apart * (data.stacked_mm - problem.chain.stacked(explanation.values))[:n]
    of_input = np.array([one.history.input_mm - history.input_mm for one in again]) * seen
    aside = whitener.aside[:n]
    noise = picture_noise(
        residual_mm, of_input, history.runs, 1.0 / history.sample_time_s, aside, whitener.noises[0], data.floors_mm[0]
    )
    return problem.judged_by(replace(whitener, noises=(noise, *whitener.noises[1:])), data.aim_mm)


def with_record_errors(
    problem: Problem, explanation: Explanation, again: Sequence[MeasuringChain], *, assumed_mm: Sequence[Array] = ()
) -> Explanation:
    """Add the contribution of errors of the recorded input to the covariance of an explanation.

    The likelihood contains only a rough covariance of the errors of the input. If the stage moves by nearly a simple
    fraction of the encoder step between rows, the error of the smoothed record is constant over a stroke and changes at
    reversals. The recording is therefore simulated again with a random zero of the encoder and random noise, and
    smoothed again; the estimates are taken as linear in the difference.

    Parameters
    ----------
    problem : Problem
        Estimation problem of the explanation.
    explanation : Explanation
        Explanation with its covariance. The covariance of a parameter is kept if the parameter is held constant, or if
        the prediction depends on it discontinuously.
    again : sequence of MeasuringChain
        Measuring chains with the input of simulated repetitions of the recording.
    assumed_mm : sequence of ndarray of float, shape (m,)
        Draws of the gap's errors that the likelihood assumes for the input, if the simulated ones are to replace them.
    """
    whitener = problem.whitener
    if not explanation.names or not again:
        return explanation
    estimator = _Estimator.of(problem, explanation)
    if estimator is None:
        return explanation
    truth = problem.chain.stacked(explanation.values)
    away = [whitener.one(truth - one.stacked(explanation.values)) for one in again]
    covariance = explanation.covariance.copy()
    if assumed_mm:
        own = estimator.own
        assumed = np.mean((whitener.columns(np.stack(assumed_mm, axis=1))[0].T @ estimator.weights.T) ** 2, axis=0)
        left = np.sqrt(np.clip(1.0 - assumed / np.maximum(estimator.variances, 1e-300), LEAST_LEFT, 1.0))
        covariance[np.ix_(own, own)] *= np.outer(left, left)
    return estimator.with_errors(replace(explanation, covariance=covariance), np.array(away))


@dataclass(frozen=True, slots=True, eq=False)
class _Estimator:
    """Linear estimate of the parameters of an explanation from the whitened measurement.

    Parameters
    ----------
    weights : ndarray of float, shape (p, m)
        Change of each parameter, start states excluded, per change of the whitened measurement.
    variances : ndarray of float, shape (p,)
        Variances of these parameters under the likelihood alone.
    own : ndarray of int, shape (p,)
        Places of these parameters in the covariance of the explanation.
    """

    weights: Array
    variances: Array
    own: NDArray[np.intp]

    @classmethod
    def of(cls, problem: Problem, explanation: Explanation) -> "_Estimator | None":
        """Linearise about an explanation; None if the prediction depends on every parameter discontinuously."""
        listed = problem.parameters(explanation.names)
        smooth = np.array([not parameter.rugged for _, parameter in listed])
        if not smooth.any():
            return None
        columns = problem.whitener.columns(derivatives(problem, explanation))[0][:, smooth]
        offsets, metric = problem.offsets, problem.offsets.metric(explanation.sigma_mm)
        bent = offsets.beside(columns, metric)
        starts = np.array([parameter.run is not None for _, parameter in listed])[smooth]
        normal = columns.T @ bent + np.diag(np.where(starts, 1.0 / START_VARIANCE, 0.0))
        inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)[~starts]
        own = np.flatnonzero(smooth[[parameter.run is None for _, parameter in listed]])
        return cls(inverse @ bent.T, np.diag(inverse[:, ~starts]), own)

    def with_errors(self, explanation: Explanation, away: Array) -> Explanation:
        """Add the mean square of the changes that whitened errors cause, shape (k, m); held parameters stay held."""
        found, covariance = away @ self.weights.T, explanation.covariance.copy()
        known = np.diag(covariance)[self.own] > 0.0
        moved = self.own[known]
        covariance[np.ix_(moved, moved)] += found[:, known].T @ found[:, known] / len(found)
        return replace(explanation, covariance=covariance)


def _assumed(problem: Problem, rng: np.random.Generator) -> list[Array]:
    """Draw errors of the stacked channels as the likelihood assumes them for the recorded input; each of shape (m,)."""
    whitener, history = problem.whitener, problem.chain.history
    stays, out = float(np.exp(-2.0 / max(whitener.input_samples, 0.04))), list[Array]()
    for _ in range(ASSUMED):
        held = [_autoregression(stays, run.stop - run.start, rng) for run in history.runs]
        passing = whitener.passing_mm * rng.standard_normal(history.input_mm.size)
        drawn = np.zeros(problem.measured.size)
        drawn[: history.input_mm.size] = passing + whitener.input_mm * np.concatenate(held)
        out.append(drawn)
    return out


def _autoregression(phi: float, count: int, rng: np.random.Generator) -> Array:
    """First-order autoregression of unit variance; shape (count,)."""
    start = phi * float(rng.standard_normal())
    shocks = np.sqrt(1.0 - phi**2) * rng.standard_normal(count)
    shocks[0] += start
    return recursion(phi, shocks)


def simulated_records(data: Observations, rng: np.random.Generator) -> Iterator[MeasuringChain]:
    """Measuring chains with the input of simulated repetitions of the recording; none of a record without errors."""
    record, chain, (_, time_s, runs) = data.recorded, data.chain, recorded(data.table)
    if time_s is None:
        return
    if record.log is not None:
        yield from data.other_paths()
        return
    path_mm, sigma_mm, step_mm = record.along_mm, record.sigma_mm, record.step_mm
    for _ in range(int(np.clip(MOST_ROWS // path_mm.size, FEWEST_RECORDS, RECORDS))):
        again = SmoothedRecord.known(read_again(path_mm, sigma_mm, step_mm, rng), time_s, runs, sigma_mm, step_mm)
        yield chain.with_input(chain.history.input_mm + (again.path_mm - path_mm)[data.table.path_rows])

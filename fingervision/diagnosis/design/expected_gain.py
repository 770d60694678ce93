"""Expected discrimination of a run: the chi-square by which it is expected to separate two explanations."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fingervision.diagnosis.design.augmented_dataset import REFITTED, AugmentedDataset
from fingervision.diagnosis.inference.evidence import noise_doubt
from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.channel_noises import SHORT_RUN
from fingervision.diagnosis.noise.noise_model import Noise, without_input
from fingervision.diagnosis.noise.restricted_likelihood import drawn_noises
from fingervision.domain.effect import Array


def problems_of_drawn_noise(
    data: Observations, problem: Problem, explanation: Explanation, count: int, rng: np.random.Generator
) -> Iterator[Problem]:
    """Yield the estimation problem with `count` random draws of its noise parameters.

    For short runs, level and correlation of the noise are poorly known, and are drawn from their posterior given the
    residual of an explanation. For long records, the noise power at low frequency is drawn.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    problem : Problem
        Estimation problem with the estimated noise.
    explanation : Explanation
        Explanation that is subtracted from the measurement to obtain the noise.
    count : int
        Number of draws.
    rng : numpy Generator
        Generator for the draws.
    """
    for noises in _noises(data, problem, explanation, count, rng):
        yield problem.judged_by(replace(problem.whitener, noises=noises), data.aim_mm)


def _noises(
    data: Observations, problem: Problem, explanation: Explanation, count: int, rng: np.random.Generator
) -> list[tuple[Noise, ...]]:
    history, whitener = problem.chain.history, problem.whitener
    if history.time_s is None or max(run.stop - run.start for run in history.runs) >= SHORT_RUN:
        factors = np.exp(0.5 * noise_doubt(problem) * rng.standard_normal(count))
        return [
            tuple(Noise(f * n.white_mm, f * n.correlated_mm, n.correlation) for n in whitener.noises)
            for f in factors.tolist()
        ]
    channels = len(whitener.noises)
    residuals = np.split(data.aim_mm - data.chain.stacked(explanation.values), channels)
    drawn = drawn_noises(residuals, history.runs, np.split(whitener.aside, channels), count, rng)
    return [(without_input(gap, whitener.passing_mm, data.floors_mm[0]), *others) for gap, *others in drawn]


TRUTHS = 16
"""Number of draws from each explanation's posterior, each with its own noise."""
MANY_SAMPLES, FEW_TRUTHS = 6000, 4
"""Number of samples above which fewer draws of the posterior are simulated, because a long table leaves little
uncertainty."""
FURTHER = 2
"""Number of additional starting points of a rival's refit: a single search may end in a local minimum."""
NOISES = 4000
"""Number of draws of the run's noise."""
PROMISED = 0.95
"""Coverage probability of the stated interval of a gain."""
REZEROED = 0.5
"""Prior probability that the run has an offset relative to the data."""
MOST = 75.0
"""Largest gain that is stated unless a larger one is nearly certain: which of two explanations is true, and where a
contact or stop acts, may change it by a factor of a thousand, and more than this decides in any case."""


def expected_gain(
    data: Observations,
    problem: Problem,
    input_mm: Array,
    pair: tuple[Explanation, Explanation],
    odds: tuple[float, float],
    found: tuple[Sequence[Point], Sequence[Point]],
    rng: np.random.Generator,
    *,
    rezeroed: bool = False,
) -> tuple[float, tuple[float, float]]:
    """Predict the gain of a run from its posterior predictive distribution given the measured data.

    For each draw, a true explanation and noise are drawn from the posterior, the run is simulated with them, and both
    explanations are refitted to the data and the run together. The noise of the proposed run gives the difference of
    two chi-squares a standard deviation of 2 sqrt(gain).

    Parameters
    ----------
    data, problem : Observations, Problem
        The measured data and their estimation problem.
    input_mm : ndarray of float, shape (k,)
        Input of the run.
    pair : tuple of Explanation
        The two explanations to be distinguished.
    odds : tuple of float
        Posterior probabilities of the two explanations, with sum 1.
    found : tuple of sequences of dict
        Posterior draws of the parameters of each explanation.
    rng : numpy Generator
        Generator of the noise.
    rezeroed : bool
        Whether the stage is re-zeroed before the run.

    Returns
    -------
    gain : float
        Median of the gain; at most `MOST`, or the lower limit of the interval.
    interval : tuple of float
        Limits between which the gain lies with the probability `PROMISED`.
    """
    count = TRUTHS if problem.chain.history.input_mm.size + input_mm.size <= MANY_SAMPLES else FEW_TRUTHS
    gains: list[float] = []
    chances: list[float] = []
    for true, other in ((0, 1), (1, 0)):
        further = _spread(found[other], FURTHER)
        truths = _spread(found[true], count)
        noisy = problems_of_drawn_noise(data, problem, pair[true], len(truths), rng)
        for values, first in zip(truths, noisy, strict=True):
            run = AugmentedDataset.of(data, first, input_mm, rezeroed=rezeroed)
            target = run.expected(values)
            # The offset of a run after a re-zeroing is estimated from both runs together.
            sigma_mm = None if rezeroed else _offsets(first, pair[true], rng)
            known = sigma_mm if first.offsets.runs > 1 else None
            rival, own = (_refitted(first, pair[each], known) for each in (other, true))
            after = run.score(target, rival, [rival.values, *further], sigma_mm)
            gains.append(after - run.score(target, own, [values], sigma_mm) - rival.score + own.score)
            chances.append(odds[true] / len(truths))
    mean = np.maximum(np.array(gains), 0.0)
    drawn = mean[rng.choice(mean.size, NOISES, p=np.array(chances) / sum(chances))]
    come = drawn + 2.0 * np.sqrt(drawn) * rng.standard_normal(NOISES)
    low, middle, high = np.quantile(come, (0.5 - 0.5 * PROMISED, 0.5, 0.5 + 0.5 * PROMISED)).tolist()
    return max(low, min(middle, MOST)), (low, high)


def _offsets(problem: Problem, explanation: Explanation, rng: np.random.Generator) -> tuple[float, ...]:
    """Draw the standard deviation of the runs' offsets for each channel; from its prior if there is only one run.

    For a single run, the standard deviation is zero in half of the draws, because the stage need not be re-zeroed
    before the new run. In the other half of the draws, it is drawn from the half-Cauchy prior of `RunOffsets.spread`,
    as in a diagnosis of both runs. With several runs, the standard deviation of the offsets is drawn from its
    posterior.
    """
    if problem.offsets.runs > 1:
        return problem.offsets.drawn_spread(problem.measured - problem.whitened(explanation.values), rng)
    share = abs(rng.standard_cauchy()) if rng.random() < REZEROED else 0.0
    return tuple(share * scale for scale in problem.offsets.scales_mm)


def _refitted(problem: Problem, explanation: Explanation, sigma_mm: tuple[float, ...] | None) -> Explanation:
    """Refit an explanation to the measured data alone.

    The standard deviation of the run offsets is fitted unless one is given.
    """
    sigma = explanation.sigma_mm if sigma_mm is None else sigma_mm
    return fit(problem, explanation.names, explanation.values, sigma_mm=sigma, iterations=REFITTED)


def _spread(points: Sequence[Point], count: int) -> Sequence[Point]:
    """Pick `count` evenly spaced points of a Markov chain."""
    step = max(1, len(points) // count)
    return points[step // 2 :: step]

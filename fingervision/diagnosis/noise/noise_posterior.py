"""Draw the noise parameters from their posterior, for predictions that depend on them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.null_bootstrap import noise_doubt
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.channel_noises import SHORT_RUN
from fingervision.diagnosis.noise.noise_model import Noise, without_input
from fingervision.diagnosis.noise.restricted_likelihood import drawn_noises
from fingervision.diagnosis.noise.run_offsets import RunOffsets


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
        whitener = replace(problem.whitener, noises=noises)
        yield replace(problem, whitener=whitener, measured=whitener.one(data.aim_mm), offsets=RunOffsets.of(whitener))


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
    return [(without_input(gap, whitener.passing_mm), *others) for gap, *others in drawn]

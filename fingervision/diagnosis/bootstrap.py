"""How much one more effect gains from noise alone: draws of the null, refitted as the data are."""

import numpy as np

from fingervision.diagnosis.explanation import Explanation, Problem, fit
from fingervision.diagnosis.signatures import Signatures, tangents
from fingervision.domain.effect import Array

QUANTILE = 0.985
DRAWS, LONG_DRAWS = 48, 24
LONG = 6000
"""Samples above which fewer draws must do."""
REFITTED = 4
"""Effects of each draw that are refitted: those whose signatures take the most of it."""
GUMBEL = float(-np.log(-np.log(QUANTILE)) - np.euler_gamma) * float(np.sqrt(6.0)) / float(np.pi)
"""Standard deviations from the mean of a maximum's distribution (Gumbel 1958) to its quantile."""


def noise_doubt(problem: Problem) -> float:
    """Relative standard uncertainty of the noise's power where it is slow, as an autoregression estimates it.

    The power at zero frequency goes with (1 + rho) / (1 - rho), and rho is known to sqrt((1 - rho^2) / n): together
    2 / sqrt((1 - rho^2) n).
    """
    rows = max(2, problem.chain.history.input_mm.size - 2)
    parts = []
    for noise in problem.whitener.noises:
        share = noise.correlated_mm**2 / noise.total_mm**2
        rho = noise.correlation
        parts.append((2.0 + share * 4.0 * rho**2 / (1.0 - rho**2)) / rows)
    return float(np.sqrt(np.mean(parts)))


def noise_alone(problem: Problem, base: Explanation, rng: np.random.Generator) -> Array:
    """Draw a whitened measurement in which `base` is the whole truth; shape (m,)."""
    offsets = problem.offsets
    noise = np.where(problem.whitener.aside, 0.0, rng.standard_normal(problem.measured.size))
    spread = np.repeat(base.sigma_mm, offsets.runs) * rng.standard_normal(offsets.channels * offsets.runs)
    return np.asarray(problem.whitened(base.values) + noise + offsets.design[:, : spread.size] @ spread)


def gain_of_noise(problem: Problem, atoms: Signatures, base: Explanation, rng: np.random.Generator) -> float:
    """Quantile of the score that the best of all further effects gains where there is none.

    Linear signatures on their grid of shapes take less from noise than the refitted effects do: a period finds its
    best place between two of the grid, an end stop the samples that it suits. So each draw is fitted with `base`,
    extended by the likeliest effects, and refitted, as the measurement was.
    """
    owner = np.array(atoms.names)
    gains = []
    doubt = noise_doubt(problem)
    for _ in range(DRAWS if problem.chain.history.input_mm.size <= LONG else LONG_DRAWS):
        target = noise_alone(problem, base, rng)
        alone = fit(problem, base.names, base.values, target=target, iterations=5)
        along = tangents(problem, alone) if alone.names else None
        gain, coefficient = atoms.gains(alone.residual, problem.offsets, problem.offsets.metric(alone.sigma_mm), along)
        gain[np.isin(owner, base.names)] = 0.0
        best = alone.score
        for _ in range(REFITTED):
            top = int(np.argmax(gain))
            if gain[top] <= 0.0:
                break
            name = atoms.names[top]
            start = {**alone.values, name: atoms.begin(top, float(coefficient[top]))}
            best = min(best, fit(problem, (*base.names, name), start, target=target, iterations=6).score)
            gain[owner == name] = 0.0
        gains.append((alone.score - best) * float(np.exp(doubt * rng.standard_normal())))
    return float(np.mean(gains) + GUMBEL * np.std(gains))

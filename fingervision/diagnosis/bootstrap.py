"""How much one more effect gains from noise alone: draws of the null, refitted as the data are."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from fingervision.diagnosis.explanation import Explanation, Problem, fit
from fingervision.diagnosis.signatures import Signatures, tangents
from fingervision.domain.effect import Array

QUANTILE = 0.985
DRAWS, LONG_DRAWS, FEWEST = 40, 20, 10
SURELY = 3.0
"""Standard errors of the quantile beyond which no further draw would change the answer."""
LONG = 6000
"""Samples above which fewer draws must do."""
LINEAR_DRAWS = 300
REFIT_MARGIN = 0.2
"""Share at most by which the threshold of linear signatures is raised for all that refitting finds between them."""
REFITTED = 2
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


def linear_threshold(problem: Problem, columns: Array, sigma: tuple[float, ...], rng: np.random.Generator) -> float:
    """Largest gain that any column takes from noise alone, at the quantile of the family."""
    offsets, metric = problem.offsets, problem.offsets.metric(sigma)
    kept = columns if columns.shape[0] <= 6000 else columns[:: columns.shape[0] // 4000]
    noise = rng.standard_normal((kept.shape[0], LINEAR_DRAWS))
    if kept.shape[0] == columns.shape[0]:
        shared = offsets.design.T @ columns
        prior = np.array([sigma[c] for c in range(offsets.channels) for _ in range(offsets.runs)])
        noise += offsets.design[:, : prior.size] @ (prior[:, None] * rng.standard_normal((prior.size, LINEAR_DRAWS)))
        noise -= offsets.design @ (metric @ (offsets.design.T @ noise))
        norm = np.einsum("ij,ij->j", columns, columns) - np.einsum("ij,ij->j", shared, metric @ shared)
    else:
        norm = np.einsum("ij,ij->j", kept, kept)
    usable = norm > 1e-9
    gains = (kept.T[usable] @ noise) ** 2 / norm[usable, None]
    # The noise itself is estimated, from as many samples as there are.
    doubt = np.exp(noise_doubt(problem) * rng.standard_normal(LINEAR_DRAWS))
    quantile = float(np.quantile(gains.max(axis=0) * doubt, QUANTILE))
    return quantile * (1.0 + min(REFIT_MARGIN, 3.0 * float(np.sqrt(2.0 / columns.shape[0])))) + 1.5


def noise_alone(problem: Problem, base: Explanation, rng: np.random.Generator) -> tuple[Problem, Array]:
    """Draw a measurement in which `base` is the whole truth.

    Returns
    -------
    shaken : Problem
        With a recorded input that holds other errors. They are in the input that every effect acts on, so that some
        effects seem to take them out again: a delay of part of a sample averages two of them, a stop cuts the largest.
    target : ndarray of float, shape (m,)
        Whitened measurement.
    """
    offsets, whitener = problem.offsets, problem.whitener
    truth = problem.whitened(base.values)
    spread = np.repeat(base.sigma_mm, offsets.runs) * rng.standard_normal(offsets.channels * offsets.runs)
    truth = truth + offsets.design[:, : spread.size] @ spread
    if not (whitener.passing_mm.any() or whitener.input_mm.any()):
        noise = np.where(whitener.aside, 0.0, rng.standard_normal(problem.measured.size))
        return problem, np.asarray(truth + noise)
    history, samples = problem.chain.history, problem.chain.history.input_mm.size
    reach = 1e-3 * history.input_span_mm
    ends = [replace(history, input_mm=history.input_mm + way) for way in (-reach, reach)]
    low, high = (replace(problem.chain, history=end).stacked(base.values)[:samples] for end in ends)
    slope = np.maximum(np.abs(high - low) / (2.0 * reach), 1e-9)
    stays = float(np.exp(-2.0 / max(whitener.input_samples, 0.04)))
    staying = np.concatenate([_autoregression(stays, run.stop - run.start, rng) for run in history.runs])
    error = (whitener.passing_mm * rng.standard_normal(samples) + whitener.input_mm * staying) / slope
    shaken = replace(history, input_mm=history.input_mm + error)
    noise = whitener.one(_of_pictures(problem, rng))
    return replace(problem, chain=replace(problem.chain, history=shaken)), np.asarray(truth + noise)


def _of_pictures(problem: Problem, rng: np.random.Generator) -> Array:
    """Draw the noise of the pictures alone, channels stacked; shape (m,), in mm."""
    out = []
    for noise in problem.whitener.noises:
        for run in problem.chain.history.runs:
            count = run.stop - run.start
            white = noise.white_mm * rng.standard_normal(count)
            out.append(white + noise.correlated_mm * _autoregression(noise.correlation, count, rng))
    return np.concatenate(out)


def _autoregression(phi: float, count: int, rng: np.random.Generator) -> Array:
    """First-order autoregression of unit variance; shape (count,)."""
    start = phi * rng.standard_normal(1)
    shocks = np.sqrt(1.0 - phi**2) * rng.standard_normal(count)
    return np.asarray(lfilter([1.0], [1.0, -phi], shocks, zi=start)[0], dtype=np.float64)


def exceeds_noise(
    gained: float,
    problem: Problem,
    atoms: Signatures,
    base: Explanation,
    suspects: list[dict[str, Mapping[str, float]]],
    rng: np.random.Generator,
) -> bool:
    """Whether a gain is above the quantile of what the best of all further effects gains where there is none.

    Linear signatures on their grid of shapes take less from noise than the refitted effects do: a period finds its
    best place between two of the grid, an end stop the samples that it suits. So each draw is fitted with `base`,
    extended by the likeliest effects, and refitted, as the measurement was. `suspects` are what the measurement itself
    speaks for, with parameters: they are tried on every draw.
    """
    owner = np.array(atoms.names)
    gains: list[float] = []
    quantile = 0.0
    doubt = noise_doubt(problem)
    for _ in range(DRAWS if problem.chain.history.input_mm.size <= LONG else LONG_DRAWS):
        shaken, target = noise_alone(problem, base, rng)
        alone = fit(shaken, base.names, base.values, target=target, iterations=5)
        along = tangents(problem, alone) if alone.names else None
        gain, coefficient = atoms.gains(alone.residual, problem.offsets, problem.offsets.metric(alone.sigma_mm), along)
        gain[np.isin(owner, base.names)] = 0.0
        starts = [{**alone.values, **suspect} for suspect in suspects]
        asked = [name for suspect in suspects for name in suspect]
        for _ in range(len(asked) + REFITTED):
            # What the measurement speaks for first, wherever it suits this draw; then what suits the draw best.
            among = owner == asked.pop(0) if asked else np.ones(owner.size, dtype=bool)
            top = int(np.argmax(np.where(among, gain, 0.0)))
            if gain[top] > 0.0:
                name = atoms.names[top]
                starts.append({**alone.values, name: atoms.begin(top, float(coefficient[top]))})
                gain[owner == name] = 0.0
        scores = [fit(shaken, tuple(start), start, target=target, iterations=6).score for start in starts]
        gains.append((alone.score - min([alone.score, *scores])) * float(np.exp(doubt * rng.standard_normal())))
        spread = float(np.std(gains))
        quantile = float(np.mean(gains)) + GUMBEL * spread
        # The quantile's own error is that of a mean and of GUMBEL standard deviations together.
        error = spread * float(np.sqrt((1.0 + 0.5 * GUMBEL**2) / len(gains)))
        if len(gains) >= FEWEST and abs(gained - quantile) > SURELY * error:
            break
    return gained > quantile

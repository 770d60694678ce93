"""Null bootstrap: distribution of the gain of one more effect if only noise is present."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import MANY_STEPS, fit
from fingervision.diagnosis.inference.signatures import Signatures, tangents
from fingervision.domain.effect import Array, Flags

QUANTILE = 0.98
"""Quantile of the largest excess over all families: one table of noise in fifty leads to a claim (one in forty would
require more simulated tables)."""
DRAWS, LONG_DRAWS, FEWEST = 40, 20, 10
"""Largest number of refitted draws, the same for a long record, and the least number before stopping: a Gumbel quantile
estimated from 40 draws is known to 15 %."""
SURELY = 3.0
"""Distance from the quantile in standard errors above which no further draw would change the decision."""
LONG = 6000
"""Number of samples above which fewer draws are made."""
THINNED = 4000
"""Number of rows at least kept of a record longer than `LONG`: the quantile of a maximum hardly depends on the number
of rows, and 300 draws of them take a tenth of a second per thousand columns."""
OWN_QUANTILE = 0.95
"""Quantile of one family's gain in noise: as high as the number of draws permits."""
LINEAR_DRAWS = 300
"""Number of draws of linear gains: the 98 % quantile is then the sixth largest value."""
REFIT_MARGIN = 0.2
"""Largest relative increase of the threshold for linear signatures to allow for the additional gain by refitting
between them."""
REFITTED = 2
"""Number of effects refitted in each draw: those whose signatures gain most."""
GUMBEL = float(-np.log(-np.log(QUANTILE)) - np.euler_gamma) * float(np.sqrt(6.0)) / float(np.pi)
"""Distance of the quantile from the mean of a maximum's distribution, in standard deviations (Gumbel 1958)."""


def noise_doubt(problem: Problem) -> float:
    """Largest relative standard uncertainty, over the channels, of the noise power at low frequency.

    The power at zero frequency is proportional to (1 + rho) / (1 - rho), and an autoregression determines rho with
    standard uncertainty sqrt((1 - rho^2) / n): the relative uncertainty of the power is therefore 2 / sqrt((1 - rho^2)
    n). If a spectrum is fitted without its lowest frequencies, the noise power at the lowest frequencies is less well
    determined (`noise_by_spectrum`).
    """
    rows = max(2, problem.chain.history.input_mm.size - 2)
    parts = []
    for noise in problem.whitener.noises:
        share = noise.correlated_mm**2 / noise.total_mm**2
        rho = noise.correlation
        parts.append((2.0 + share * 4.0 * rho**2 / (1.0 - rho**2)) / rows + noise.slow_doubt**2)
    return float(np.sqrt(max(parts)))


def linear_thresholds(
    problem: Problem,
    names: tuple[str, ...],
    columns: Array,
    sigma: tuple[float, ...],
    rng: np.random.Generator,
    among: Flags | None = None,
) -> dict[str, float]:
    """Significance threshold of each effect: the gain that its best signature seldom exceeds in noise alone.

    The signatures of one effect, one for each starting value of its parameters, form a family. The best of many
    signatures gains more from noise than a single signature does; a common threshold for all families would be
    determined by the largest family. Therefore each family of signatures is compared with its own upper quantile, and
    the probability that any family exceeds its quantile is limited: all families contribute equally to the false
    positives (Beran 1988).

    Parameters
    ----------
    names : tuple of str, length k
        Family of each column.
    columns : ndarray of float, shape (m, k)
        Whitened signatures or probes.
    sigma : tuple of float
        Spread of the run offsets for each channel.
    among : ndarray of bool, shape (k,), or None
        Columns that count; None for all.
    """
    offsets, metric = problem.offsets, problem.offsets.metric(sigma)
    kept = columns if columns.shape[0] <= LONG else columns[:: columns.shape[0] // THINNED]
    noise = rng.standard_normal((kept.shape[0], LINEAR_DRAWS))
    if kept.shape[0] == columns.shape[0]:
        shared = offsets.design.T @ columns
        prior = np.array([sigma[c] for c in range(offsets.channels) for _ in range(offsets.runs)])
        noise += offsets.design[:, : prior.size] @ (prior[:, None] * rng.standard_normal((prior.size, LINEAR_DRAWS)))
        noise = offsets.beside(noise, metric)
        norm = np.einsum("ij,ij->j", columns, columns) - np.einsum("ij,ij->j", shared, metric @ shared)
    else:
        norm = np.einsum("ij,ij->j", kept, kept)
    usable = norm > 1e-9 if among is None else among & (norm > 1e-9)
    owner = np.array(names)
    # The noise level itself is uncertain, because it is estimated from the samples.
    doubt = np.exp(noise_doubt(problem) * rng.standard_normal(LINEAR_DRAWS))
    margin = 1.0 + min(REFIT_MARGIN, 3.0 * float(np.sqrt(2.0 / columns.shape[0])))
    tail, excess = {}, np.full(LINEAR_DRAWS, -np.inf)
    taken = (kept.T @ noise) ** 2 / np.where(usable, norm, 1.0)[:, None]
    for name in dict.fromkeys(names):
        mine = usable & (owner == name)
        if not mine.any():
            continue
        gains = np.max(taken[mine], axis=0) * doubt
        # Refitting also reaches values between the grid points; an effect with a single column has no grid.
        gains = gains * margin + 1.5 if mine.sum() > 1 else gains
        tail[name] = float(np.quantile(gains, OWN_QUANTILE))
        excess = np.maximum(excess, gains - tail[name])
    if not tail:
        return {}
    beyond = float(np.quantile(excess, QUANTILE))
    return {name: own + beyond for name, own in tail.items()}


def noise_alone(problem: Problem, base: Explanation, rng: np.random.Generator) -> tuple[Problem, Array]:
    """Simulate a measurement for which the explanation `base` is true.

    Returns
    -------
    shaken : Problem
        Estimation problem with other random errors in the recorded input. All effects act on this input, so that some
        of them seem to reduce its errors: a delay by part of a sample averages two errors, an end stop clips the
        largest.
    target : ndarray of float, shape (m,)
        The simulated measurement, whitened.
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
    low, high = (
        problem.chain.with_input(history.input_mm + way).stacked(base.values)[:samples] for way in (-reach, reach)
    )
    slope = np.maximum(np.abs(high - low) / (2.0 * reach), 1e-9)
    stays = float(np.exp(-2.0 / max(whitener.input_samples, 0.04)))
    staying = np.concatenate([autoregression(stays, run.stop - run.start, rng) for run in history.runs])
    error = (whitener.passing_mm * rng.standard_normal(samples) + whitener.input_mm * staying) / slope
    noise = whitener.one(_of_pictures(problem, rng))
    shaken = problem.chain.with_input(history.input_mm + error)
    return replace(problem, chain=shaken), np.asarray(truth + noise)


def jumps_astray(problem: Problem, names: tuple[str, ...]) -> bool:
    """Whether an explanation contains jumps at poorly known inputs, so that a misplaced jump shifts all later jumps."""
    unsure = problem.whitener.passing_mm.any() or problem.whitener.input_mm.any()
    return bool(unsure) and any(parameter.rugged for _, parameter in problem.parameters(names))


def rare(values: Sequence[float]) -> float:
    """Estimate, from a few draws, the value of a maximum that is exceeded once in 50 draws."""
    return float(np.mean(values)) + GUMBEL * float(np.std(values))


def _of_pictures(problem: Problem, rng: np.random.Generator) -> Array:
    """Simulate only the noise of the pictures (mm) for the stacked channels, shape (m,)."""
    out = []
    for noise in problem.whitener.noises:
        for run in problem.chain.history.runs:
            count = run.stop - run.start
            white = noise.white_mm * rng.standard_normal(count)
            out.append(white + noise.correlated_mm * autoregression(noise.correlation, count, rng))
    return np.concatenate(out)


def autoregression(phi: float, count: int, rng: np.random.Generator) -> Array:
    """First-order autoregression of unit variance; shape (count,)."""
    start = phi * rng.standard_normal(1)
    shocks = np.sqrt(1.0 - phi**2) * rng.standard_normal(count)
    return np.asarray(lfilter([1.0], [1.0, -phi], shocks, zi=start)[0], dtype=np.float64)


def price(thresholds: Mapping[str, float], base: Explanation, names: tuple[str, ...]) -> float:
    """Smallest gain required of the effects that are added to those of `base`.

    The required gain is infinite for an effect that run offsets can imitate completely.
    """
    return max(thresholds.get(name, np.inf) for name in names if name not in base.names)


def exceeds_noise(
    excess: float,
    problem: Problem,
    atoms: Signatures,
    thresholds: Mapping[str, float],
    base: Explanation,
    suspects: list[dict[str, Mapping[str, float]]],
    rng: np.random.Generator,
) -> bool:
    """Whether a gain above the thresholds is also larger than the largest gain that one more effect has in noise alone.

    The thresholds are computed with nonlinear parameters (such as a period, or the position of an end stop) on a grid.
    A fit of the parameters also finds values between the grid points, and therefore reduces chi-square further, even in
    noise. Each simulated table is therefore fitted like the measurement: first with `base`, then with `base` and each
    of the most promising effects. `suspects` are the effects, with parameters, that fit the measurement best; they are
    tried on every simulated table.
    """
    owner = np.array(atoms.names)
    asking = np.array([thresholds.get(name, np.inf) for name in atoms.names])
    found: list[float] = []
    quantile = 0.0
    doubt = noise_doubt(problem)
    # Misplaced jumps must be searched for as thoroughly as in the measurement.
    astray = jumps_astray(problem, base.names)
    steps, draws = (MANY_STEPS, FEWEST) if astray else (5, DRAWS)
    for _ in range(draws if problem.chain.history.input_mm.size <= LONG else min(draws, LONG_DRAWS)):
        shaken, target = noise_alone(problem, base, rng)
        alone = fit(shaken, base.names, base.values, target=target, iterations=steps)
        along = tangents(problem, alone) if alone.names else None
        gain, coefficient = atoms.gains(alone.residual, problem.offsets, problem.offsets.metric(alone.sigma_mm), along)
        above = np.where((gain > 0.0) & ~np.isin(owner, base.names), gain - asking, -np.inf)
        starts = [{**alone.values, **suspect} for suspect in suspects]
        asked = [name for suspect in suspects for name in suspect]
        for _ in range(len(asked) + REFITTED):
            # First try the effects that the measurement suggests, then those that fit this draw best.
            among = owner == asked.pop(0) if asked else np.ones(owner.size, dtype=bool)
            top = int(np.argmax(np.where(among, above, -np.inf)))
            if np.isfinite(above[top]) and among[top]:
                name = atoms.names[top]
                starts.append({**alone.values, name: atoms.begin(top, float(coefficient[top]))})
                above[owner == name] = -np.inf
        # After a failed jump fit, use the measured residual level as the noise level, in the measurement and in every
        # draw.
        luck = base.score / alone.score if astray else float(np.exp(doubt * rng.standard_normal()))
        fits = [fit(shaken, tuple(start), start, target=target, iterations=6) for start in starts]
        found.append(
            max(max(0.0, alone.score - e.score) * luck - price(thresholds, base, e.names) for e in fits)
            if fits
            else -min(thresholds.values(), default=0.0)
        )
        quantile = rare(found)
        # The error of the quantile combines that of the mean and that of GUMBEL standard deviations.
        error = float(np.std(found)) * float(np.sqrt((1.0 + 0.5 * GUMBEL**2) / len(found)))
        if len(found) >= FEWEST and abs(excess - quantile) > SURELY * error:
            break
    return excess > max(quantile, 0.0)

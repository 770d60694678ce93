"""Posterior odds of explanations: whether one is far more probable than another, and the smallest effects so found."""

from itertools import islice
from math import comb

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.signatures import Signatures
from fingervision.diagnosis.input.record_nuisances import below_the_input
from fingervision.domain.effect import Array

FREEDOM = 4.0
"""Degrees of freedom of Student's t distribution for the physical priors: typical sizes are known only roughly, so that
the penalty grows slowly far beyond them (Lange, Little & Taylor 1989)."""
STRONG = 6.0
"""-2 log of odds of 1 to 20: less is no strong evidence for an explanation (2 ln 20; Kass & Raftery 1995,
doi:10.1080/01621459.1995.10476572)."""

SURELY = 1.645
"""Standard deviations that nineteen of twenty values do not exceed."""


def rms(values: Array) -> float:
    """Root mean square of values."""
    return float(np.sqrt(np.mean(values**2)))


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


def odds(problem: Problem, explanation: Explanation) -> float:
    """-2 log of the posterior odds: BIC, prior density of the parameters, and prior for the number of alternatives."""
    return explanation.bic + surprise(problem, explanation) + choices(problem, explanation)


def choices(problem: Problem, explanation: Explanation) -> float:
    """-2 log of the prior probability of one explanation among all with the same number of effects.

    There are many more pairs than single effects, so that some pair fits well by chance; therefore each number of
    effects has the same total prior probability (extended BIC, Chen & Chen 2008).
    """
    return 2.0 * float(np.log(comb(len(problem.effects), len(explanation.names))))


def surprise(problem: Problem, explanation: Explanation) -> float:
    """-2 log of the ratio of the parameters' prior density to the density at the prior's centre."""
    return sum(
        (FREEDOM + 1.0) * float(np.log1p(((value - (p.neutral or 0.0)) / p.typical) ** 2 / FREEDOM))
        for name, p in problem.parameters(explanation.names)
        if p.typical is not None
        for value in [explanation.values[name][p.name]]
    )


def speaks_for(problem: Problem, found: list[Explanation], base: Explanation) -> bool:
    """Whether the odds that one of some explanations is true, and not `base`, are more than 20 to 1.

    The noise is taken as large as it may be by its uncertainty. Beside jumps at poorly known inputs its level is
    unknown altogether, and integrated out: one jump goes astray, and with it all that follow.
    """
    if not found:
        return False
    costs = np.array([odds(problem, e) for e in found])
    likeliest = found[int(np.argmin(costs))]
    gained = base.score - likeliest.score
    if jumps_astray(problem, base.names):
        gained = problem.rows * float(np.log(base.score / likeliest.score))
    # The price of the runs' offsets does not depend on the level of the noise.
    offsets = problem.offsets
    old, new = (offsets.squared(e.residual, offsets.metric(e.sigma_mm)) for e in (base, likeliest))
    gained -= (old - new) * (1.0 - float(np.exp(-SURELY * noise_doubt(problem))))
    together = costs.min() - 2.0 * float(np.log(np.sum(np.exp(0.5 * (costs.min() - costs)))))
    price = together - likeliest.score - odds(problem, base) + base.score
    return bool(gained > max(price + STRONG, _averaging_gains(problem, likeliest, base)))


def jumps_astray(problem: Problem, names: tuple[str, ...]) -> bool:
    """Whether an explanation contains jumps at poorly known inputs, so that a misplaced jump shifts all later jumps."""
    unsure = problem.whitener.passing_mm.any() or problem.whitener.input_mm.any()
    return bool(unsure) and any(parameter.rugged for _, parameter in problem.parameters(names))


def _averaging_gains(problem: Problem, one: Explanation, base: Explanation) -> float:
    """Largest gain of an effect that only removes the errors of the recorded input: with memory, or at an end.

    It is at most what the errors that differ from row to row contribute to chi-square: a play of two standard
    uncertainties of the record removed the noise of all readings at rest, an end stop that of a rest at an end. What
    smoothing has left is common to `input_samples` rows, and is not removed.
    """
    if not _may_follow_errors(problem, one, base):
        return 0.0
    whitener = problem.whitener
    errors = whitener.passing_mm**2 + whitener.input_mm**2
    share = errors / (errors + whitener.noises[0].total_mm ** 2)
    return float(np.sum(share)) / max(1.0, whitener.input_samples)


def _may_follow_errors(problem: Problem, one: Explanation, base: Explanation) -> bool:
    """Whether an explanation adds an effect that can follow errors of the record: with memory, or at an end."""
    added = [problem.effects[name] for name in one.names if name not in base.names]
    return any(effect.memory or effect.stands_at for effect in added)


def follows_the_input(problem: Problem, one: Explanation, base: Explanation) -> bool:
    """Whether an explanation changes another one by less than the errors of the recorded input, which it may follow.

    In noise alone, a lag by a sixth of a sample gained 120 in chi-square. An offset or a ratio follows no error, and
    counts if it can be seen.
    """
    if not (problem.whitener.passing_mm.any() or problem.whitener.input_mm.any()):
        return False
    if not base.names and not _may_follow_errors(problem, one, base):
        return False
    change = problem.chain.stacked(one.values) - problem.chain.stacked(base.values)
    return below_the_input(problem, rms(change))


PATHS, TWICE = 8, 2.0
"""Number of other paths of the log to which an effect is fitted (the RMS of its change is then known to a quarter), and
least ratio of its change to this RMS: two standard uncertainties."""


def beyond_the_log(problem: Problem, found: list[Explanation], base: Explanation) -> list[Explanation]:
    """Drop the likeliest of some explanations as long as it changes `base` no more than an encoder's log can.

    An effect with memory is also fitted to what `base` predicts along other paths that the log permits, where it does
    not act. In a log of an encoder with one step from row to row, a limit at the stage's own speed removed most of the
    path's error, although nothing was hidden.
    """
    kept, behind_encoder = list(found), problem.chain.history.input_step_mm > 0.0
    while behind_encoder and kept:
        one = min(kept, key=lambda explanation: explanation.bic)
        if not _may_follow_errors(problem, one, base):
            break
        alone = problem.chain.stacked(base.values)
        aims = [problem.whitener.one(chain.stacked(base.values)) for chain in islice(problem.other_paths(), PATHS)]
        fits = [fit(problem, one.names, one.values, target=aim, sigma_mm=base.sigma_mm, iterations=5) for aim in aims]
        caused = [problem.chain.stacked(each.values) - alone for each in fits]
        if not fits or rms(problem.chain.stacked(one.values) - alone) > TWICE * rms(np.array(caused)):
            break
        kept = [explanation for explanation in kept if explanation is not one]
    return kept


def detection_limits(problem: Problem, atoms: Signatures, nothing: Explanation) -> dict[str, dict[str, object]]:
    """Compute the detection limit of each effect: its size whose odds against no effect are nearly always 20 to 1."""
    norm = atoms.columns.lengths(problem.offsets.metric(nothing.sigma_mm))
    out: dict[str, dict[str, object]] = {}
    for name in problem.effects:
        listed = [parameter for _, parameter in problem.parameters((name,)) if parameter.run is None]
        price = len(listed) * float(np.log(problem.rows)) + 2.0 * float(np.log(len(problem.effects))) + STRONG
        needed = float(np.sqrt(price)) + SURELY
        amplitudes = {p.name: p for p in listed if p.neutral is not None}
        sizes: list[tuple[float, str]] = []
        for k in (k for k, owner in enumerate(atoms.names) if owner == name and norm[k] > 0.0):
            grow = atoms.grows[k]
            if grow is not None:
                sizes.append((abs(grow[2]) * needed / float(np.sqrt(norm[k])), grow[0]))
            elif norm[k] > needed**2:
                sizes += [
                    (abs(atoms.starts[k][p.name] - (p.neutral or 0.0)), p.name)
                    for p in amplitudes.values()
                    if atoms.starts[k][p.name] != p.neutral
                ]
        if sizes:
            size, parameter = min(sizes)
            out[name] = {"parameter": parameter, "size": size, "unit": amplitudes[parameter].unit}
    return out

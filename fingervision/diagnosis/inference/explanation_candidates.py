"""Candidate explanations of one to three effects: ranked by linear signatures, then refitted jointly."""

from collections.abc import Callable, Iterable
from itertools import permutations

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit, refit, scan
from fingervision.diagnosis.inference.signatures import Signatures, tangents
from fingervision.domain.effect import Array
from fingervision.domain.parameter import Parameter

Progress = Callable[[float], None]
SCANNED = 6
"""Number of explanations in addition to which an effect with jumps is tried at all its sizes: the position of its jumps
depends on the other effects."""
BEGINS = 4
"""Number of signatures from which a single effect is fitted, because chi-square over time constants and widths has
several local minima."""
SCREENED, REFINED = 3, 16
"""Steps of a first fit from each start, and number of extensions that are then refitted thoroughly: in 70 searches
(measured rigs, hidden effects), the best extension had at worst the eighth rank after three steps."""
LONG = 6000
"""Number of samples above which sizes of a jump are scanned in addition to one explanation only."""
LEAST_GAIN = 4.0
"""Least chi-square gain of an effect's signature for which a refit is tried."""
ALIKE = 12.0
"""Squared whitened distance below which two predictions count as equal, as in the ambiguity set."""
FINEST, COARSEST = 0.003, 0.02
"""Smallest and largest relative spacing of the sizes that are tried for a jump: at most two thousand sizes, and at
least as many as signatures."""
FINE_VALUES = 4_000_000
"""Largest number of values in all such predictions: 32 MB."""
SWAPS_REFITTED = 24
"""Number of partners refitted for each half of the best pair: each half has at most 26."""


def best_each(explanations: Iterable[Explanation]) -> list[Explanation]:
    """Keep the best fit of every set of effects; best first."""
    found: dict[tuple[str, ...], Explanation] = {}
    for explanation in sorted(explanations, key=lambda one: one.bic):
        found.setdefault(explanation.names, explanation)
    return sorted(found.values(), key=lambda one: one.score)


def single_effects(
    problem: Problem, atoms: Signatures, iterations: int, begins: int = BEGINS, most: int | None = None
) -> list[Explanation]:
    """Fit each effect alone, from its most promising signatures, or the `most` promising effects only; best first."""
    nothing = problem.nothing()
    gain, coefficient = atoms.gains(nothing, tangents(problem, nothing))
    owner = np.array(atoms.names)
    found = []
    promising = dict.fromkeys(owner[np.argsort(-gain, kind="stable")].tolist())
    for name in list(promising)[:most]:
        mine = np.flatnonzero(owner == name)
        mine = mine[np.argsort(-gain[mine])]
        starts = [atoms.begin(k, coefficient[k]) for k in mine[:begins]]
        listed = [parameter for _, parameter in problem.parameters((name,)) if parameter.run is None]
        if len(listed) == 1 and listed[0].rugged and listed[0].logarithmic and 2.0 * gain[mine[0]] > np.max(gain):
            between = [{listed[0].name: value} for value in _finely(problem, listed[0]).tolist()]
            starts.append(scan(problem, nothing, name, between)[0])
        tries = [fit(problem, (name,), {name: start}, iterations=SCREENED) for start in starts]
        best = likeliest(tries)
        found.append(fit(problem, (name,), best.values, iterations=iterations))
    return sorted(found, key=lambda explanation: explanation.score)


def _finely(problem: Problem, parameter: Parameter) -> Array:
    """Trial sizes of a jump, spaced so closely that the last jump of a stroke moves by one sample; shape (k,)."""
    history = problem.chain.history
    steps = np.concatenate([np.diff(history.input_mm[run]) for run in history.runs])
    moving = np.abs(steps[np.abs(steps) > 0.0])
    # A stroke covers at most the range, and a jump occurs at a sample.
    apart = float(np.clip(np.median(moving) / max(history.input_span_mm, 1e-300), FINEST, COARSEST))
    begins = parameter.starting_values()
    count = int(float(np.log(begins[-1] / begins[0])) / apart) + 1
    return np.geomspace(begins[0], begins[-1], max(1, min(count, FINE_VALUES // problem.measured.size)))


def extended(
    problem: Problem,
    atoms: Signatures,
    bases: list[Explanation],
    most: int,
    progress: Progress,
    *,
    scanned: int = SCANNED,
    refined: int = REFINED,
) -> list[Explanation]:
    """Add each effect to each base explanation: start from signatures in the base's residual, then refit jointly.

    Parameters
    ----------
    problem, atoms
        The data, and the signatures of all effects.
    bases : list of Explanation
        Explanations to which one effect is added.
    most, refined : int
        Extensions that are refitted, and how many of them thoroughly.
    progress : callable
        Called with the share of the work that is done.
    scanned : int
        Number of base explanations to which an effect with jumps is added at all its sizes.
    """
    owner = np.array(atoms.names)
    planned: list[tuple[float, Explanation, str, dict[str, float]]] = []
    scanned = scanned if problem.chain.history.input_mm.size <= LONG else 1
    for place, base in enumerate(bases):
        gain, coefficient = atoms.gains(base, tangents(problem, base))
        for name in problem.effects:
            mine = np.flatnonzero(owner == name)
            if name in base.names or not mine.size:
                continue
            if place < scanned and any(parameter.rugged for _, parameter in problem.parameters((name,))):
                start, score = scan(problem, base, name, [atoms.starts[k] for k in mine])
                if base.score - score > LEAST_GAIN:
                    planned.append((score, base, name, start))
            k = int(mine[np.argmax(gain[mine])])
            if gain[k] > LEAST_GAIN:
                planned.append((base.score - float(gain[k]), base, name, atoms.begin(k, float(coefficient[k]))))
    planned.sort(key=lambda plan: plan[0])
    found: list[Explanation] = []
    for index, (_, base, name, start) in enumerate(planned[:most]):
        found.append(fit(problem, (*base.names, name), {**base.values, name: start}, iterations=SCREENED))
        progress((index + 1) / most)
    ranked = best_each(found)
    return sorted(
        [refit(problem, e) for e in ranked[:refined]] + ranked[refined:],
        key=lambda e: e.score,
    )


def pairs_in_time(problem: Problem, atoms: Signatures, singles: list[Explanation]) -> list[Explanation]:
    """Fit every pair of effects with memory, each from the best of one's starting values beside the fit of the other.

    The signature of an effect with memory beside another one is hardly linear: a search from signatures missed a speed
    limit with a resonance, and stopped at four times their residual.
    """
    owner, found = np.array(atoms.names), list[Explanation]()
    acting = [e for e in singles if problem.effects[e.names[0]].memory]
    for base, other in permutations(acting, 2):
        name = other.names[0]
        start, _ = scan(problem, base, name, [atoms.starts[k] for k in np.flatnonzero(owner == name)])
        found.append(fit(problem, (*base.names, name), {**base.values, name: start}, iterations=7))
    return found


def swapped(problem: Problem, atoms: Signatures, pairs: list[Explanation]) -> list[Explanation]:
    """Replace each effect of the best explanation by every other effect; remaining effects start at fitted values.

    An effect that was fitted alone has absorbed the influence of a second effect; its parameters are then so far from
    the joint optimum that a joint search starting there would not find it.
    """
    if not pairs:
        return pairs
    best = pairs[0]
    rests = [{name: best.values[name] for name in best.names if name != dropped} for dropped in best.names]
    halves = [fit(problem, tuple(rest), rest, iterations=0) for rest in rests]
    return best_each([*pairs, *extended(problem, atoms, halves, SWAPS_REFITTED, lambda _: None)])


def different(problem: Problem, explanations: list[Explanation], most: int) -> list[Explanation]:
    """Keep the best of several explanations with equal predictions, such as offsets of input, gap and edge."""
    found, predicted = list[Explanation](), list[Array]()
    for explanation in explanations:
        curve = problem.whitened(explanation.values)
        metric = problem.offsets.metric(explanation.sigma_mm)
        if all(problem.offsets.squared(curve - other, metric) > ALIKE for other in predicted):
            found.append(explanation)
            predicted.append(curve)
        if len(found) == most:
            break
    return found


def likeliest(candidates: list[Explanation]) -> Explanation:
    """Choose the explanation with the smallest BIC (Schwarz 1978)."""
    return min(candidates, key=lambda explanation: explanation.bic)

"""Candidate explanations of one to three effects: ranked by linear signatures, then refitted jointly."""

from collections.abc import Callable, Mapping
from itertools import permutations

import numpy as np

from fingervision.diagnosis.inference.hypothesis import FORM_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import MANY_STEPS, fit, scan
from fingervision.diagnosis.inference.null_bootstrap import LONG
from fingervision.diagnosis.inference.signatures import Signatures, tangents
from fingervision.diagnosis.input.record_nuisances import below_the_input
from fingervision.domain.effect import Array
from fingervision.domain.parameter import Parameter

Progress = Callable[[float], None]
SCANNED = 6
"""Number of explanations in addition to which an effect with jumps is tried at all its sizes: the position of its jumps
depends on the other effects."""
BEGINS = 4
"""Number of signatures from which a single effect is fitted, because chi-square over time constants and widths has
several local minima."""
REFINED = 8
"""Number of extensions that are refitted thoroughly: in tests, no extension with a lower rank after seven steps ever
became the best."""
PROMISE = 0.5
"""Share of the required gain that a signature must have before its refit is tried. A refit between the grid points
gains at most a fifth more (`REFIT_MARGIN`), and joint refitting with earlier effects seldom twice as much."""
LEAST_GAIN = 4.0
"""Least chi-square gain of an effect's signature for which a refit is tried."""
FEW_ROWS = 0.1
"""Share of the rows affected by an end stop or a contact below which only the ends of strokes give evidence for it; on
more rows, the encoder's rounding averages out."""
ALIKE = 12.0
"""Squared whitened distance below which two predictions count as equal, as in the ambiguity set."""
STEPS_HIDDEN = 1.0
"""Encoder steps below which an effect is indistinguishable from rounding."""
FINEST, COARSEST = 0.003, 0.02
"""Smallest and largest relative spacing of the sizes that are tried for a jump: at most two thousand sizes, and at
least as many as signatures."""
FINE_VALUES = 4_000_000
"""Largest number of values in all such predictions: 32 MB."""
SWAPS_REFITTED = 24
"""Number of partners refitted for each half of the best pair: each half has at most 26."""


def single_effects(problem: Problem, atoms: Signatures, iterations: int, begins: int = BEGINS) -> list[Explanation]:
    """Fit each effect alone, from its most promising signatures; best first."""
    nothing = problem.nothing()
    gain, coefficient = atoms.gains(nothing.residual, problem.offsets, problem.offsets.metric(nothing.sigma_mm))
    owner = np.array(atoms.names)
    found = []
    for name in problem.effects:
        mine = np.flatnonzero(owner == name)
        if not mine.size:
            continue
        mine = mine[np.argsort(-gain[mine])]
        starts = [atoms.begin(k, coefficient[k]) for k in mine[:begins]]
        listed = [parameter for _, parameter in problem.parameters((name,)) if parameter.run is None]
        if len(listed) == 1 and listed[0].rugged and listed[0].logarithmic and 2.0 * gain[mine[0]] > np.max(gain):
            between = [{listed[0].name: value} for value in _finely(problem, listed[0]).tolist()]
            starts.append(scan(problem, nothing, name, between)[0])
        tries = [fit(problem, (name,), {name: start}, iterations=5) for start in starts]
        best = min(tries, key=lambda explanation: explanation.score)
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
    asked: Mapping[str, float] | None = None,
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
    asked : mapping of str to float or None
        Least significant gain in chi-square of each effect. Extensions whose signatures promise less than half of this
        gain are not refitted. None to try all.
    """
    owner = np.array(atoms.names)
    planned: list[tuple[float, Explanation, str, dict[str, float]]] = []
    scanned = scanned if problem.chain.history.input_mm.size <= LONG else 1
    for place, base in enumerate(bases):
        metric = problem.offsets.metric(base.sigma_mm)
        gain, coefficient = atoms.gains(base.residual, problem.offsets, metric, tangents(problem, base))
        for name in problem.effects:
            mine = np.flatnonzero(owner == name)
            if name in base.names or not mine.size:
                continue
            least = LEAST_GAIN if asked is None else max(LEAST_GAIN, PROMISE * asked.get(name, 0.0))
            if place < scanned and any(parameter.rugged for _, parameter in problem.parameters((name,))):
                start, score = scan(problem, base, name, [atoms.starts[k] for k in mine])
                if base.score - score > least:
                    planned.append((score, base, name, start))
            k = int(mine[np.argmax(gain[mine])])
            if gain[k] > least:
                planned.append((base.score - float(gain[k]), base, name, atoms.begin(k, float(coefficient[k]))))
    planned.sort(key=lambda plan: plan[0])
    found: dict[tuple[str, ...], Explanation] = {}
    for index, (_, base, name, start) in enumerate(planned[:most]):
        explanation = fit(problem, (*base.names, name), {**base.values, name: start}, iterations=7)
        old = found.get(explanation.names)
        if old is None or explanation.score < old.score:
            found[explanation.names] = explanation
        progress((index + 1) / most)
    ranked = sorted(found.values(), key=lambda explanation: explanation.score)
    return sorted(
        [fit(problem, e.names, e.values, iterations=20) for e in ranked[:refined]] + ranked[refined:],
        key=lambda e: e.score,
    )


def pairs_in_time(problem: Problem, atoms: Signatures, singles: list[Explanation]) -> list[Explanation]:
    """Fit every pair of effects with memory, each from the best of one's starting values beside the fit of the other.

    The signature of an effect with memory beside another one is hardly linear: a search from signatures missed a speed
    limit with a resonance, and stopped at four times their residual.
    """
    owner, found = np.array(atoms.names), dict[tuple[str, ...], Explanation]()
    acting = [e for e in singles if problem.effects[e.names[0]].memory]
    for base, other in permutations(acting, 2):
        name = other.names[0]
        start, _ = scan(problem, base, name, [atoms.starts[k] for k in np.flatnonzero(owner == name)])
        pair = fit(problem, (*base.names, name), {**base.values, name: start}, iterations=7)
        if pair.names not in found or pair.score < found[pair.names].score:
            found[pair.names] = pair
    return list(found.values())


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
    found = {pair.names: pair for pair in pairs}
    for pair in extended(problem, atoms, halves, SWAPS_REFITTED, lambda _: None):
        if pair.names not in found or pair.score < found[pair.names].score:
            found[pair.names] = pair
    return sorted(found.values(), key=lambda explanation: explanation.score)


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


def added_share(problem: Problem, smaller: Explanation, larger: Explanation) -> float:
    """Change of the prediction by the additional part of the larger explanation, as a share of the total change."""
    bare, before, after = (problem.chain.stacked(values) for values in ({}, smaller.values, larger.values))
    if below_the_input(problem, float(np.sqrt(np.mean((after - before) ** 2)))):
        return 0.0
    return float(np.linalg.norm(after - before) / max(1e-12, float(np.linalg.norm(after - bare))))


def within_a_step(problem: Problem, explanation: Explanation) -> bool:
    """Whether one of the effects acts like rounding: by less than an encoder step, on few rows or at stroke ends.

    Each effect is judged alone, because an effect with memory that acts together with another effect also changes later
    rows.
    """
    history = problem.chain.history
    if history.input_step_mm == 0.0:
        return False
    reach = 0.5 * history.input_step_mm
    low, high = (problem.chain.with_input(history.input_mm + way).stacked({}) for way in (-reach, reach))
    step_mm = STEPS_HIDDEN * float(np.max(np.abs(high - low)))
    from_end = np.minimum(history.input_mm - history.input_mm.min(), history.input_mm.max() - history.input_mm)
    at_ends = np.tile(from_end < STEPS_HIDDEN * history.input_step_mm, low.size // from_end.size)
    bare = problem.chain.stacked({})
    for name in explanation.names:
        change = np.abs(problem.chain.stacked({name: explanation.values[name]}) - bare)
        largest = float(np.max(change))
        acts = change > 0.1 * largest
        if largest < step_mm and (float(np.mean(acts)) < FEW_ROWS or not np.any(acts & ~at_ends)):
            return True
    return False


def beyond_the_input(problem: Problem, smaller: Explanation, larger: list[Explanation]) -> list[Explanation]:
    """Keep the explanations whose change of the prediction exceeds the error of the recorded input.

    Explanations with a smaller change are dropped, because they only follow the rounding errors of an encoder. For
    example, a delay within one step of an encoder gained 225 in chi-square, and hid an offset and a play that changed
    the prediction by twenty times as much. If the best of the larger explanations only follows rounding errors of an
    encoder, others may do so as well. In this case, only explanations that contain all effects of `smaller` are kept.
    """
    beyond = [explanation for explanation in larger if added_share(problem, smaller, explanation) > 0.0]
    if beyond[:1] == larger[:1]:
        return beyond
    return [explanation for explanation in beyond if set(smaller.names) <= set(explanation.names)]


def without_roundings(problem: Problem, explanation: Explanation) -> Explanation:
    """Drop an effect if the other effects, refitted alone, predict the same within the recorded input's error.

    For example, in addition to a play and an offset, a delay by a small part of an encoder step only follows rounding
    errors, whichever of the three effects was found first.
    """
    while problem.chain.history.input_sigma_mm > 0.0 and len(explanation.names) > 1:
        kept = [{n: v for n, v in explanation.values.items() if n != name} for name in explanation.names]
        fewer = [fit(problem, tuple(values), values, iterations=MANY_STEPS) for values in kept]
        alike = [one for one in fewer if added_share(problem, one, explanation) == 0.0]
        if not alike:
            break
        explanation = min(alike, key=lambda one: one.score)
    return explanation


def likeliest(candidates: list[Explanation], samples: int) -> Explanation:
    """Choose the explanation with the smallest BIC (Schwarz 1978)."""
    return min(candidates, key=lambda explanation: explanation.bic(samples))


def simplest(singles: list[Explanation], samples: int, nothing: Explanation) -> Explanation:
    """Choose one effect; prefer a simpler formula if a richer one gains no more than inexact formulas usually do.

    For example, a small gain is no reason to prefer a resonance to a delay by a fraction of a sample.
    """
    best = likeliest(singles, samples)
    within = FORM_SHARE**2 * (nothing.score - best.score)
    simpler = [e for e in singles if e.free < best.free and e.score - best.score < within]
    return min(simpler, key=lambda explanation: explanation.score, default=best)

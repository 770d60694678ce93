"""Which effects: singles, pairs and triples, refitted in the chain; thresholds from a bootstrap of the null."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.inference.ambiguity_set import beside_foretold, indistinguishable, odds
from fingervision.diagnosis.inference.detection_limit import smallest_seen
from fingervision.diagnosis.inference.hypothesis_fit import FORM_SHARE, SMALL_SHARE, Explanation, Problem, fit, scan
from fingervision.diagnosis.inference.model_adequacy import imitated, shapes_of, unexplained
from fingervision.diagnosis.inference.null_bootstrap import LONG
from fingervision.diagnosis.inference.signatures import Signatures, signatures, tangents
from fingervision.diagnosis.inference.significance import Evidence
from fingervision.diagnosis.input.input_uncertainty import below_the_input
from fingervision.domain.report import Verdict

Progress = Callable[[float], None]
TRIPLE_SHARE = 0.15
"""A third effect needs evidence of its own: three effects bend to almost anything."""
PAIRS_REFITTED = 60
SWAPS_REFITTED = 24
SCANNED = 6
"""Explanations beside which an effect that jumps is tried at all its sizes: where it jumps depends on the others."""
LEAST_GAIN = 4.0
"""Chi-square that an effect's signature must take for a refit to be tried."""
SHORT = 100
"""Samples below which the noise is estimated beside single effects only."""


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """What the search found; explanations sorted best first."""

    verdict: Verdict
    best: Explanation
    alternatives: tuple[Explanation, ...]
    nothing: Explanation
    singles: tuple[Explanation, ...]
    unknown: str | None
    left_over: str | None
    smallest: dict[str, dict[str, object]]
    distances: dict[tuple[str, ...], float]
    problem: Problem


def _singles(problem: Problem, atoms: Signatures, iterations: int) -> list[Explanation]:
    nothing = problem.nothing()
    gain, coefficient = atoms.gains(nothing.residual, problem.offsets, problem.offsets.metric(nothing.sigma_mm))
    owner = np.array(atoms.names)
    found = []
    for name in problem.effects:
        mine = np.flatnonzero(owner == name)
        if not mine.size:
            continue
        mine = mine[np.argsort(-gain[mine])]
        tries = [fit(problem, (name,), {name: atoms.begin(k, coefficient[k])}, iterations=5) for k in mine[:4]]
        best = min(tries, key=lambda explanation: explanation.score)
        found.append(fit(problem, (name,), best.values, iterations=iterations))
    return sorted(found, key=lambda explanation: explanation.score)


def _extended(
    problem: Problem, atoms: Signatures, bases: list[Explanation], most: int, progress: Progress
) -> list[Explanation]:
    """Add each effect to each base: starts from signatures on what the base leaves, then joint refits."""
    owner = np.array(atoms.names)
    planned: list[tuple[float, Explanation, str, dict[str, float]]] = []
    scanned = SCANNED if problem.chain.history.input_mm.size <= LONG else 1
    for place, base in enumerate(bases):
        metric = problem.offsets.metric(base.sigma_mm)
        gain, coefficient = atoms.gains(base.residual, problem.offsets, metric, tangents(problem, base))
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
    found: dict[tuple[str, ...], Explanation] = {}
    for index, (_, base, name, start) in enumerate(planned[:most]):
        explanation = fit(problem, (*base.names, name), {**base.values, name: start}, iterations=7)
        old = found.get(explanation.names)
        if old is None or explanation.score < old.score:
            found[explanation.names] = explanation
        progress((index + 1) / most)
    ranked = sorted(found.values(), key=lambda explanation: explanation.score)
    return sorted(
        [fit(problem, e.names, e.values, iterations=20) for e in ranked[:8]] + ranked[8:], key=lambda e: e.score
    )


def _swapped(problem: Problem, atoms: Signatures, pairs: list[Explanation]) -> list[Explanation]:
    """Try every other effect beside each half of the best pair, where the pair has put it.

    Alone it had stood elsewhere: fitted to what two effects do, it ends far out in a valley out of which no joint
    search finds its way.
    """
    if not pairs:
        return pairs
    best = pairs[0]
    halves = [fit(problem, (name,), {name: best.values[name]}, iterations=0) for name in best.names]
    found = {pair.names: pair for pair in pairs}
    for pair in _extended(problem, atoms, halves, SWAPS_REFITTED, lambda _: None):
        if pair.names not in found or pair.score < found[pair.names].score:
            found[pair.names] = pair
    return sorted(found.values(), key=lambda explanation: explanation.score)


def _added(problem: Problem, smaller: Explanation, larger: Explanation) -> float:
    """Size of what the larger explanation adds, as a share of all that it changes in the prediction, in mm."""
    bare, before, after = (problem.chain.stacked(values) for values in ({}, smaller.values, larger.values))
    if below_the_input(problem, float(np.sqrt(np.mean((after - before) ** 2)))):
        return 0.0
    return float(np.linalg.norm(after - before) / max(1e-12, float(np.linalg.norm(after - bare))))


def _choose(candidates: list[Explanation], samples: int) -> Explanation:
    return min(candidates, key=lambda explanation: explanation.bic(samples))


def _simplest(singles: list[Explanation], samples: int, nothing: Explanation) -> Explanation:
    """Choose one effect, the simpler form where the richer one gains no more than forms deviate.

    Such a difference is the forms' own fault, and no reason to choose a resonance for a delay that falls between two
    samples.
    """
    best = _choose(singles, samples)
    within = FORM_SHARE**2 * (nothing.score - best.score)
    simpler = [e for e in singles if e.free < best.free and e.score - best.score < within]
    return min(simpler, key=lambda explanation: explanation.score, default=best)


def search(
    bench_problem: Callable[[Explanation | None], Problem],
    rng: np.random.Generator,
    forced: frozenset[str],
    progress: Progress,
) -> Findings:
    """Find the explanation, the others that cannot be told apart from it, and what remains.

    Parameters
    ----------
    bench_problem : callable
        Gives the problem with the noise estimated on an explanation's residual.
    rng : numpy Generator
        For the bootstrap of the null.
    forced : frozenset of str
        Effects that the user insists on.
    progress : callable
        Told the share that is done.
    """
    problem = bench_problem(None)
    atoms = signatures(problem)
    rough = _singles(problem, atoms, 4)
    # A pair fitted to a few samples takes their noise with it, which would then be estimated too small.
    many = problem.chain.history.input_mm.size >= SHORT
    pairs = _extended(problem, atoms, rough[:3], 16, lambda _: None) if many else []
    first = [*rough[:1], *pairs[:1]]
    progress(0.15)
    if first:
        problem = bench_problem(min(first, key=lambda e: e.bic(problem.measured.size)))
        atoms = signatures(problem)
    nothing = problem.nothing()
    samples = max(2, int(problem.measured.size))
    singles = _singles(problem, atoms, 20)
    evidence = Evidence.of(problem, atoms, nothing, rng)
    progress(0.3)
    best, peers = nothing, [nothing]
    pairs, foreign, shape, shapes = [], None, None, shapes_of(problem)

    if singles and (evidence.speaks_for(singles, nothing) or forced):
        best, peers = _simplest(singles[:6], samples, nothing), singles
        bases = singles[:14]
        pairs = _extended(problem, atoms, bases, PAIRS_REFITTED, lambda share: progress(0.3 + 0.4 * share))
        pairs = _swapped(problem, atoms, pairs)
        # Beside a simpler form a second effect would gain what the richest has gained already.
        if pairs and _added(problem, singles[0], pairs[0]) > SMALL_SHARE and evidence.speaks_for(pairs, singles[0]):
            best, peers = _choose(pairs[:6], samples), pairs
            triples = _extended(problem, atoms, pairs[:3], 24, lambda share: progress(0.7 + 0.1 * share))
            if triples and _added(problem, best, triples[0]) > TRIPLE_SHARE and evidence.speaks_for(triples, best):
                foreign = imitated(problem, shapes, triples[0], [nothing, *bases, *pairs[:3]])
                if foreign is None:
                    best, peers = _choose(triples[:6], samples), triples
        if len(best.names) <= 2:
            parts = [e for e in singles if e.names[0] in best.names] if len(best.names) == 2 else []
            shape = imitated(problem, shapes, best, [nothing, *parts, *singles[: len(parts)]])
    if forced:
        best, foreign, shape = _insisted(problem, forced, [*singles, *pairs], singles, samples), None, None
    progress(0.82)
    words, left = unexplained(problem, shapes, best, rng)
    # What is small beside all that was explained is left over, whether probes found it or a third effect.
    words = foreign if words is None and left is None else words
    words = shape if words is None else words
    progress(0.9)
    alternatives, distances = (
        ([best], {})
        if forced or not best.names
        else indistinguishable(problem, best, nothing, [*singles, *peers] if len(best.names) > 1 else singles, pairs)
    )
    alternatives = beside_foretold(problem, alternatives)
    best = min(alternatives, key=lambda e: odds(problem, e, samples)) if best.names else best
    alternatives.sort(key=lambda e: e is not best)
    verdict = Verdict.AGREES if not best.names else Verdict.NAMED if len(alternatives) == 1 else Verdict.AMBIGUOUS
    if words is not None:
        verdict = Verdict.UNKNOWN
        if nothing.score - best.score < 9.0 * max(0.0, best.score - samples):
            best = nothing
        alternatives = [best] if best.names else []
    return Findings(
        verdict,
        best,
        tuple(alternatives),
        nothing,
        tuple(singles),
        words,
        left,
        smallest_seen(problem, atoms, nothing, evidence.thresholds),
        distances,
        problem,
    )


def _insisted(
    problem: Problem, forced: frozenset[str], found: list[Explanation], singles: list[Explanation], samples: int
) -> Explanation:
    """Choose the best explanation that holds every effect on which the user insists."""
    able = forced & set(problem.effects)
    holding = [explanation for explanation in found if able <= set(explanation.names)]
    if holding or not able:
        return _choose(holding, samples) if able else problem.nothing()
    begin = {e.names[0]: e.values[e.names[0]] for e in singles if e.names[0] in able}
    return fit(problem, tuple(begin), begin, iterations=20)

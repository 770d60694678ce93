"""Search over single effects, pairs and triples, and again with a better noise."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fingervision.diagnosis.inference.ambiguity_set import ambiguity_set, beside_foretold
from fingervision.diagnosis.inference.evidence import (
    beyond_the_log,
    detection_limits,
    follows_the_input,
    odds,
    speaks_for,
)
from fingervision.diagnosis.inference.explanation_candidates import (
    LEAST_GAIN,
    Progress,
    best_each,
    different,
    extended,
    likeliest,
    pairs_in_time,
    single_effects,
    swapped,
)
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit, refit
from fingervision.diagnosis.inference.model_adequacy import imitated, remaining_structure
from fingervision.diagnosis.inference.random_effect import FORM, PATH, estimated_coefficients
from fingervision.diagnosis.inference.reference_gauge import consistent_with_gauges
from fingervision.diagnosis.inference.search_state import NOISY, ROUGH, Findings, SearchState, beyond_form, noise_known
from fingervision.diagnosis.inference.verdict import STANDING_SHARE, standing_of
from fingervision.diagnosis.input.observations import Observations

PAIRS_REFITTED = 60
"""Number of pairs that are refitted jointly, in the order of their signatures' gain: 27 effects have 351 pairs."""
PART_OF_UNKNOWN = 1.0 / 3.0
"""Share of the disagreement, as RMS, that effects may leave to be reported in addition to *unknown*."""
PAIRS_EXTENDED = 6
"""Number of pairs with different predictions to which a third effect is added."""
LIKELIEST = 6
"""Number of explanations, best first, among which Schwarz's criterion chooses: seldom do more explanations have the
same prediction."""
TRIPLES_REFITTED = 24
"""Number of triples that are refitted jointly, in the order of their signatures' gain."""
BASES = 14
"""Number of single effects to which a second effect is added."""


def search(
    problem_beside: Callable[[Explanation | None], Problem],
    forced: frozenset[str],
    progress: Progress,
    known: Explanation | None = None,
) -> Findings:
    """Find the best explanation, the explanations indistinguishable from it, and the remaining structure.

    The search fits one, then two, then three effects, tests for the verdict *unknown*, and collects the ambiguity set;
    each step of the search returns a new state.

    Parameters
    ----------
    problem_beside : callable
        Returns the estimation problem with the noise estimated from the residual of a given explanation.
    forced : frozenset of str
        Effects that the user requires.
    progress : callable
        Called with the share of the work that is done.
    known : Explanation or None
        Explanation found by an earlier search of the same measurement, from whose residual the noise is estimated.
    """
    state = _one_effect(noise_known(problem_beside, known), forced)
    progress(0.3)
    state = _two_effects(state, lambda share: progress(0.3 + 0.4 * share))
    state = _three_effects(state, lambda share: progress(0.7 + 0.1 * share))
    state = _insisted(state, forced) if forced else _without_imitations(state)
    progress(0.82)
    state = _gated(state)
    progress(0.9)
    return _findings(state, forced)


def _one_effect(state: SearchState, forced: frozenset[str]) -> SearchState:
    """Fit every effect alone; keep the likeliest, if its gain is significant."""
    problem = state.problem
    singles = [e for e in single_effects(problem, state.atoms, 20) if not follows_the_input(problem, e, state.nothing)]
    singles = beyond_the_log(problem, singles, state.nothing)
    state = replace(state, singles=singles)
    if not singles:
        return state
    stalled = [e for e in singles if set(e.names) & state.problem.stalled]
    if stalled and stalled[0].score < state.nothing.score:
        near = [e for e in stalled if e.score - stalled[0].score < LEAST_GAIN]
        return replace(state, best=likeliest(near), peers=singles)
    if not (speaks_for(problem, singles, state.nothing) or forced):
        return state
    return replace(state, best=likeliest(singles[:LIKELIEST]), peers=singles)


def _two_effects(state: SearchState, progress: Progress) -> SearchState:
    """Fit pairs built from single effects, then pairs in which one effect of the best pair is replaced."""
    if not state.best.names:
        return state
    problem, singles = state.problem, state.singles
    pairs = extended(problem, state.atoms, singles[:BASES], PAIRS_REFITTED, progress)
    if pairs and _leaves_structure(state, pairs[0]):
        pairs = best_each([*pairs, *pairs_in_time(problem, state.atoms, singles)])
    if _leaves_structure(state, singles[0]):
        pairs = swapped(problem, state.atoms, pairs)
    pairs = [e for e in pairs if not follows_the_input(problem, e, singles[0])]
    state = replace(state, pairs=pairs)
    # Pairs are compared with the best single effect: compared with a simpler formula, a second effect would gain what a
    # richer formula has already gained.
    clear = [e for e in pairs[:LIKELIEST] if beyond_form(state, singles[0], e)]
    clear = beyond_the_log(problem, clear, singles[0])
    return replace(state, best=likeliest(clear), peers=pairs) if speaks_for(problem, clear, singles[0]) else state


def _leaves_structure(state: SearchState, explanation: Explanation) -> bool:
    """Whether an explanation leaves more than noise, and more than the share that it may leave, in chi-square."""
    rows = state.problem.rows
    left = explanation.score - rows
    return bool(left > max(NOISY * rows**0.5, STANDING_SHARE**2 * (state.nothing.score - rows)))


def _three_effects(state: SearchState, progress: Progress) -> SearchState:
    """Fit triples, unless one or two probes with fewer effects fit as well."""
    if len(state.best.names) != 2:
        return state
    problem, pairs = state.problem, state.pairs
    bases = different(problem, pairs, PAIRS_EXTENDED)
    tried = extended(problem, state.atoms, bases, TRIPLES_REFITTED, progress, scanned=ROUGH)
    triples = [e for e in tried if not follows_the_input(problem, e, state.best)]
    state = replace(state, triples=triples)
    clear = [e for e in triples[:LIKELIEST] if beyond_form(state, state.best, e)]
    if not speaks_for(problem, clear, state.best):
        return state
    imitation = imitated(problem, state.shapes, triples[0], [state.nothing, *state.singles[:BASES], *pairs[:3]])
    if imitation is not None:
        return replace(state, imitation=imitation)
    triples.sort(key=lambda e: e.bic)
    triples = swapped(problem, state.atoms, triples)
    return replace(state, triples=triples, best=likeliest(triples[:LIKELIEST]), peers=triples)


def _without_imitations(state: SearchState) -> SearchState:
    """Check whether one or two effects only imitate a shape that is not in the catalogue."""
    best, singles = state.best, state.singles
    if not best.names or len(best.names) > 2:
        return state
    parts = [e for e in singles if e.names[0] in best.names] if len(best.names) == 2 else []
    imitation = imitated(state.problem, state.shapes, best, [state.nothing, *parts, *singles[: len(parts)]])
    return state if imitation is None else replace(state, imitation=imitation, unknown=imitation)


def _gated(state: SearchState) -> SearchState:
    """Test the residual of the best explanation with generic probes."""
    unknown, left_over = remaining_structure(state.problem, state.shapes, state.best)
    # Structure that is small compared with the explained change is reported as remaining, whether probes or a third
    # effect found it.
    if unknown is None and left_over is None:
        unknown = state.imitation
    return replace(state, unknown=state.unknown if unknown is None else unknown, left_over=left_over)


def _findings(state: SearchState, forced: frozenset[str]) -> Findings:
    """Collect explanations indistinguishable from the best; for *unknown*, keep an effect that explains much."""
    problem, best, nothing = state.problem, state.best, state.nothing
    alternatives, distances = [best], dict[tuple[str, ...], float]()
    if best.names:
        alternatives, distances = _indistinguishable(state, forced)
    alternatives = beside_foretold(problem, alternatives)
    best = min(alternatives, key=lambda e: odds(problem, e)) if best.names else best
    alternatives.sort(key=lambda e: e is not best)
    if state.unknown is not None:
        alternatives = [best] if best.names else []
    return Findings(
        best=best,
        alternatives=tuple(alternatives),
        nothing=nothing,
        singles=tuple(state.singles),
        nearest=likeliest([nothing, *state.singles[:1], *state.pairs[:LIKELIEST]]),
        unknown=state.unknown,
        left_over=state.left_over,
        smallest=detection_limits(problem, state.atoms, nothing),
        distances=distances,
        problem=problem,
    )


def _insisted(state: SearchState, forced: frozenset[str]) -> SearchState:
    """Choose the best explanation that contains every effect that the user requires.

    The required effects are also added to the explanations that were found without them, because an effect that is much
    smaller than two other effects is in none of the pairs that fit.
    """
    problem = state.problem
    able = forced & set(problem.effects)
    if not able:
        return replace(state, best=problem.nothing(), imitation=None)
    found = [*state.singles, *state.pairs, *state.triples]
    holding = [explanation for explanation in found if able <= set(explanation.names)]
    required = {e.names[0]: e.values[e.names[0]] for e in state.singles if e.names[0] in able}
    # The required effects are added to every explanation that the data do not distinguish from the best; if they were
    # added to the best only, rounding errors would choose among explanations that are equal.
    bases = _indistinguishable(state, frozenset())[0] if state.best.names else [state.best]
    begins = [required | dict(base.values) for base in bases]
    together = [fit(problem, tuple(begin), begin, iterations=20) for begin in begins]
    peers = [*holding, *together]
    best = likeliest(peers)
    if set(best.names) <= able and not speaks_for(problem, [best], state.nothing):
        # Beside another effect, a required one that is not seen widens the uncertainty; alone, it is refuted.
        best = problem.nothing()
    return replace(state, best=best, peers=peers, imitation=None)


def _indistinguishable(
    state: SearchState, forced: frozenset[str]
) -> tuple[list[Explanation], dict[tuple[str, ...], float]]:
    """Collect the explanations with the required effects that the data cannot distinguish from the best.

    Also returned are the distances of explanations from the best.
    """
    able = forced & set(state.problem.effects)
    if forced:
        pool, pairs = [peer for peer in state.peers if able <= set(peer.names)], list[Explanation]()
    else:
        pool = [*state.singles, *state.peers] if len(state.best.names) > 1 else state.singles
        pairs = state.pairs
    return ambiguity_set(state.problem, state.best, state.nothing, pool, pairs)


def problem_of(data: Observations, explanation: Explanation | None) -> Problem:
    """Estimation problem whose noise is estimated from an explanation's residual, or else from the disagreement."""
    if explanation is None:
        return data.problem(data.stacked_mm - data.chain.stacked({}), 0, explained=False)
    values, free = explanation.values, explanation.free
    residual_mm = data.stacked_mm - data.chain.stacked(values)
    problem = data.problem(residual_mm, free, explained=True, values=values)
    columns_mm = np.hstack([data.path_errors_mm(values), data.form_errors_mm(values)])
    if not columns_mm.any():
        return problem
    # What the errors of path and formulas explain is no noise of the picture.
    errors, _ = estimated_coefficients(problem, problem.judged(explanation, values), PATH, FORM)
    return data.problem(residual_mm - columns_mm @ errors, free, explained=True, values=values)


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """A completed search: measurement and model, findings, and the results of reference slots."""

    data: Observations
    found: Findings
    said: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Settings of searches."""

    rng: np.random.Generator
    forced: frozenset[str]
    progress: Progress

    def again(self, data: Observations, known: Explanation | None = None) -> Searched:
        """Search once more, with the noise estimated from the residual of the effects found so far."""
        look = partial(search, partial(problem_of, data), self.forced, self.progress)
        found = look(known)
        if data.form_errors_mm(found.best.values).shape[1] != dict(found.problem.random).get(FORM):
            # The errors of the formulas are those of the effects that were found.
            found = look(found.best)
        small = found.unknown is not None and standing_of(data, found).share > PART_OF_UNKNOWN
        if small and not self.forced & set(found.best.names):
            found = replace(found, best=found.nothing, alternatives=())
        found, said = consistent_with_gauges(data, found)
        return Searched(data, found, said)


def refitted(state: Searched) -> Searched:
    """Refit the best explanation with the noise and the random effects that belong to it."""
    problem, best = problem_of(state.data, state.found.best), state.found.best
    return replace(state, found=state.found.with_best(refit(problem, best), problem))

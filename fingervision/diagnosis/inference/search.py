"""Search over single effects, pairs and triples, with significance thresholds from the null bootstrap."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from fingervision.diagnosis.inference.ambiguity_set import ambiguity_set, beside_foretold, odds
from fingervision.diagnosis.inference.detection_limit import detection_limits
from fingervision.diagnosis.inference.explanation_candidates import (
    LEAST_GAIN,
    Progress,
    added_share,
    different,
    extended,
    likeliest,
    simplest,
    single_effects,
    swapped,
    within_a_step,
)
from fingervision.diagnosis.inference.hypothesis import FORM_SHARE, SMALL_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.model_adequacy import imitated, remaining_structure, shapes_of
from fingervision.diagnosis.inference.probe_basis import Probes
from fingervision.diagnosis.inference.signatures import Signatures, signatures
from fingervision.diagnosis.inference.significance import Evidence

TRIPLE_SHARE = 0.15
"""Least share of the whole change of the prediction that a third effect must contribute (`added_share`): three effects
can fit almost anything."""
PAIRS_REFITTED = 60
"""Number of pairs that are refitted jointly, those first whose signatures gain most: 27 effects have 351 pairs."""
PART_OF_UNKNOWN = 9.0
"""Ratio, in chi-square, of the part that an effect explains to the remaining residual above which the effect is
reported in addition to *unknown*: the residual is then a third of the disagreement, as RMS."""
COMPLETE = 0.05
"""Largest remaining share, in chi-square beyond the noise, of a complete explanation: effects that only fit the
inexactness of another effect's formula reduce it by less."""
NOISY = 2.0 * 2.0**0.5
"""Excess of the chi-square of noise over the number of rows n that occurs now and then, in units of sqrt(n): two
standard deviations sqrt(2 n)."""
PAIRS_EXTENDED = 6
"""Pairs of different predictions to which a third effect is added: three of them may be one pair by three names."""
LIKELIEST = 6
"""Explanations, best first, among which Schwarz's criterion chooses: those of one prediction are seldom more."""
TRIPLES_REFITTED = 24
"""Triples refitted jointly, those first whose signatures take the most: a fifth of what all pairs would be."""
ROUGH = 2
"""Starts, and explanations refitted thoroughly, of a first search that is for the noise alone; where its fit is poor,
the chi-square of the answer says so, and the search is repeated (`searched.QUIET`)."""
BASES = 14
"""Number of single effects to which a second effect is added."""
SHORT = 100
"""Number of samples below which the noise is estimated with single effects only."""


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """Result of a search: explanations in descending order of their score.

    `nearest` is the most probable explanation of one or two effects, whether or not its second effect is large enough
    to be named.
    """

    best: Explanation
    alternatives: tuple[Explanation, ...]
    nothing: Explanation
    singles: tuple[Explanation, ...]
    nearest: Explanation
    unknown: str | None
    left_over: str | None
    smallest: dict[str, dict[str, object]]
    distances: dict[tuple[str, ...], float]
    problem: Problem


def _completes(state: "_State", smaller: Explanation, larger: Explanation) -> bool:
    """Whether the larger explanation removes nearly all of the smaller one's residual, as a true one does.

    For this test, the residual of the smaller explanation must clearly exceed the noise and the inexactness of its
    formula. An effect that is added fits part of that inexactness, however large the residual is. Other effects in its
    place depend less on that inexactness; if these leave only noise, the smaller explanation is kept only within the
    typical inexactness of formulas. In one case, a creep that left 70 times the noise (3.6 % of what it explained) had
    been kept in place of a ratio and an offset that left none.
    """
    rows = state.values - int(state.problem.whitener.aside.sum())
    stands = smaller.score - rows
    joins = set(smaller.names) <= set(larger.names)
    noise_alone = not joins and larger.score - rows < NOISY * rows**0.5
    share = state.problem.form_share if joins else FORM_SHARE if noise_alone else SMALL_SHARE
    plain = max(float(rows), share**2 * (state.nothing.score - smaller.score))
    return stands > plain and (noise_alone or larger.score - rows < COMPLETE * stands)


def search(
    problem_beside: Callable[[Explanation | None], Problem],
    rng: np.random.Generator,
    forced: frozenset[str],
    progress: Progress,
    known: Explanation | None = None,
) -> Findings:
    """Find the best explanation, the indistinguishable ones, and the remaining structure.

    The search fits one, then two, then three effects, tests for the verdict *unknown*, and collects the ambiguity set;
    each of these functions returns a new state.

    Parameters
    ----------
    problem_beside : callable
        Returns the estimation problem with the noise estimated from the residual of a given explanation.
    rng : numpy Generator
        Generator for the null bootstrap.
    forced : frozenset of str
        Effects that the user requires.
    progress : callable
        Called with the share of the work that is done.
    known : Explanation or None
        Explanation found by an earlier search of the same measurement, from whose residual the noise is estimated.
    """
    state = _one_effect(_noise_known(problem_beside, known), rng, forced)
    progress(0.3)
    state = _two_effects(state, lambda share: progress(0.3 + 0.4 * share))
    state = _three_effects(state, lambda share: progress(0.7 + 0.1 * share))
    state = _insisted(state, forced) if forced else _without_imitations(state)
    progress(0.82)
    state = _gated(state, rng)
    progress(0.9)
    return _findings(state, forced)


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """State of the search.

    Parameters
    ----------
    problem, atoms : Problem, Signatures
        The estimation problem, and the signatures of all effects.
    nothing, best : Explanation
        The model without effects, and the present best explanation.
    peers : list of Explanation
        Explanations with as many effects as the best, best first.
    shapes : Probes
        Generic shapes that are not in the catalogue.
    singles, pairs, triples : list of Explanation
        All explanations with one effect, and the most probable ones with two and three, best first.
    evidence : Evidence or None
        Criterion for the significance of gains.
    imitation, unknown, left_over : str or None
        Description of a probe that effects only imitate; of structure that no effect explains; of remaining structure
        that is small.
    """

    problem: Problem
    atoms: Signatures
    nothing: Explanation
    best: Explanation
    peers: list[Explanation]
    shapes: Probes
    singles: list[Explanation] = field(default_factory=list)
    pairs: list[Explanation] = field(default_factory=list)
    triples: list[Explanation] = field(default_factory=list)
    evidence: Evidence | None = None
    imitation: str | None = None
    unknown: str | None = None
    left_over: str | None = None

    @property
    def values(self) -> int:
        """Number of measured values, at least 2."""
        return max(2, int(self.problem.measured.size))

    def speaks_for(self, found: list[Explanation], base: Explanation) -> bool:
        """Whether the best of some explanations gains more in chi-square over `base` than noise alone would."""
        return self.evidence is not None and self.evidence.speaks_for(found, base)


def _noise_known(problem_beside: Callable[[Explanation | None], Problem], known: Explanation | None) -> _State:
    """Estimate the noise from the residual of the known effects, or of those from a rough first search."""
    if known is not None:
        problem = problem_beside(known)
        nothing = problem.nothing()
        return _State(problem, signatures(problem), nothing, nothing, [nothing], shapes_of(problem))
    problem = problem_beside(None)
    atoms = signatures(problem)
    rough = single_effects(problem, atoms, 4, ROUGH)
    # A pair fitted to a few samples takes their noise with it, which would then be estimated too small.
    many = problem.chain.history.input_mm.size >= SHORT
    pairs = extended(problem, atoms, rough[:3], 16, lambda _: None, scanned=1, refined=ROUGH) if many else []
    first = [*rough[:1], *pairs[:1]]
    if first:
        problem = problem_beside(min(first, key=lambda e: e.bic(problem.measured.size)))
        atoms = signatures(problem)
    nothing = problem.nothing()
    return _State(problem, atoms, nothing, nothing, [nothing], shapes_of(problem))


def _one_effect(state: _State, rng: np.random.Generator, forced: frozenset[str]) -> _State:
    """Fit every effect alone; keep the simplest that is as good as the best, if its gain is significant."""
    problem = state.problem
    singles = [e for e in single_effects(problem, state.atoms, 20) if not within_a_step(problem, e)]
    evidence = Evidence.of(state.problem, state.atoms, state.nothing, rng)
    state = replace(state, singles=singles, evidence=evidence)
    if not singles:
        return state
    stalled = [e for e in singles if set(e.names) & state.problem.stalled]
    if stalled and stalled[0].score < state.nothing.score:
        near = [e for e in stalled if e.score - stalled[0].score < LEAST_GAIN]
        return replace(state, best=simplest(near, state.values, state.nothing), peers=singles)
    if not (state.speaks_for(singles, state.nothing) or forced):
        return state
    return replace(state, best=simplest(singles[:LIKELIEST], state.values, state.nothing), peers=singles)


def _two_effects(state: _State, progress: Progress) -> _State:
    """Fit pairs built from single effects, then pairs in which one effect of the best pair is replaced."""
    if not state.best.names:
        return state
    problem, singles = state.problem, state.singles
    pairs = extended(problem, state.atoms, singles[:BASES], PAIRS_REFITTED, progress)
    pairs = [e for e in swapped(problem, state.atoms, pairs) if not within_a_step(problem, e)]
    state = replace(state, pairs=pairs)
    # Beside a simpler form a second effect would gain what the richest has gained already.
    if not pairs:
        return state
    large = added_share(problem, singles[0], pairs[0]) > SMALL_SHARE
    if (large or any(_completes(state, singles[0], pair) for pair in pairs[:LIKELIEST])) and state.speaks_for(
        pairs, singles[0]
    ):
        return replace(state, best=likeliest(pairs[:LIKELIEST], state.values), peers=pairs)
    return state


def _three_effects(state: _State, progress: Progress) -> _State:
    """Fit triples of effects, unless one or two generic shapes together with fewer effects fit as well."""
    if len(state.best.names) != 2:
        return state
    problem, pairs = state.problem, state.pairs
    bases = different(problem, pairs, PAIRS_EXTENDED)
    asked = None if state.evidence is None else state.evidence.thresholds
    tried = extended(problem, state.atoms, bases, TRIPLES_REFITTED, progress, scanned=ROUGH, asked=asked)
    triples = [e for e in tried if not within_a_step(problem, e)]
    state = replace(state, triples=triples)
    if not triples:
        return state
    large = added_share(problem, state.best, triples[0]) > TRIPLE_SHARE
    if not (large or _completes(state, state.best, triples[0])) or not state.speaks_for(triples, state.best):
        return state
    imitation = imitated(problem, state.shapes, triples[0], [state.nothing, *state.singles[:BASES], *pairs[:3]])
    if imitation is not None:
        # Where it changes little, what the third effect imitates is left over, and the gate will tell it.
        return replace(state, imitation=imitation) if large else state
    triples.sort(key=lambda e: e.bic(state.values))
    triples = [e for e in swapped(problem, state.atoms, triples) if not within_a_step(problem, e)]
    return replace(state, triples=triples, best=likeliest(triples[:LIKELIEST], state.values), peers=triples)


def _without_imitations(state: _State) -> _State:
    """Check whether one or two effects only imitate a shape that is not in the catalogue."""
    best, singles = state.best, state.singles
    if not best.names or len(best.names) > 2:
        return state
    parts = [e for e in singles if e.names[0] in best.names] if len(best.names) == 2 else []
    imitation = imitated(state.problem, state.shapes, best, [state.nothing, *parts, *singles[: len(parts)]])
    return state if imitation is None else replace(state, imitation=imitation, unknown=imitation)


def _gated(state: _State, rng: np.random.Generator) -> _State:
    """Test the residual of the best explanation with generic probes."""
    unknown, left_over = remaining_structure(state.problem, state.shapes, state.best, rng)
    # What is small beside all that was explained is left over, whether probes found it or a third effect.
    if unknown is None and left_over is None:
        unknown = state.imitation
    return replace(state, unknown=state.unknown if unknown is None else unknown, left_over=left_over)


def _findings(state: _State, forced: frozenset[str]) -> Findings:
    """Collect the explanations indistinguishable from the best; for the verdict *unknown*, keep the largest effect."""
    problem, best, nothing = state.problem, state.best, state.nothing
    alternatives, distances = [best], dict[tuple[str, ...], float]()
    if best.names and not forced:
        pool = [*state.singles, *state.peers] if len(best.names) > 1 else state.singles
        alternatives, distances = ambiguity_set(problem, best, nothing, pool, state.pairs)
    alternatives = beside_foretold(problem, alternatives)
    best = min(alternatives, key=lambda e: odds(problem, e, state.values)) if best.names else best
    alternatives.sort(key=lambda e: e is not best)
    if state.unknown is not None:
        stands = max(0.0, best.score - state.values)
        if nothing.score - best.score < PART_OF_UNKNOWN * stands:
            best = nothing
        alternatives = [best] if best.names else []
    smallest = (
        {} if state.evidence is None else detection_limits(problem, state.atoms, nothing, state.evidence.thresholds)
    )
    return Findings(
        best=best,
        alternatives=tuple(alternatives),
        nothing=nothing,
        singles=tuple(state.singles),
        nearest=likeliest([nothing, *state.singles[:1], *state.pairs[:LIKELIEST]], state.values),
        unknown=state.unknown,
        left_over=state.left_over,
        smallest=smallest,
        distances=distances,
        problem=problem,
    )


def _insisted(state: _State, forced: frozenset[str]) -> _State:
    """Choose the best explanation that contains every effect that the user requires.

    The required effects are also added to the best explanation that was found without them: one that is hardly there
    beside two others is in none of the explanations with two effects that fit.
    """
    problem = state.problem
    able = forced & set(problem.effects)
    if not able:
        return replace(state, best=problem.nothing(), imitation=None)
    found = [*state.singles, *state.pairs, *state.triples]
    holding = [explanation for explanation in found if able <= set(explanation.names)]
    begin = {e.names[0]: e.values[e.names[0]] for e in state.singles if e.names[0] in able} | dict(state.best.values)
    together = fit(problem, tuple(begin), begin, iterations=20)
    return replace(state, best=likeliest([*holding, together], state.values), imitation=None)

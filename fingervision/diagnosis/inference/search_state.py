"""State of a search for effects: explanations with one, two and three effects, and the evidence for them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from fingervision.diagnosis.inference.explanation_candidates import (
    extended,
    single_effects,
)
from fingervision.diagnosis.inference.hypothesis import FORM_SHARE, SMALL_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.model_adequacy import shapes_of
from fingervision.diagnosis.inference.probe_basis import Probes
from fingervision.diagnosis.inference.signatures import Signatures, changes, signatures

NOISY = 2.0 * 2.0**0.5
"""Excess of the chi-square of noise over the number of rows n that occurs now and then, in units of sqrt(n): two
standard deviations sqrt(2 n)."""
ROUGH = 2
"""Number of starts, and of explanations refitted thoroughly, in a first search whose only purpose is to estimate the
noise."""
ROUGH_EFFECTS = 6
"""Number of effects that are fitted in it, in the order of their signatures' gain."""
SHORT = 100
"""Number of samples below which the noise is estimated with single effects only."""


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """Result of a search; explanations in descending order of their score.

    `nearest` is the most probable explanation with one or two effects, whether or not its second effect is large enough
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

    def with_best(self, best: Explanation, problem: Problem | None = None) -> "Findings":
        """Return the findings with the best explanation refitted, and the estimation problem of this refit."""
        others = tuple(best if explanation is self.best else explanation for explanation in self.alternatives)
        return replace(self, best=best, alternatives=others, problem=problem or self.problem)


def beyond_form(state: "SearchState", smaller: Explanation, larger: Explanation) -> bool:
    """Whether a larger explanation gains more than the inexact formulas of the smaller one leave to anything else.

    The shares of all formulas of the smaller explanation add up. If the larger explanation does not contain the effects
    of the smaller one, and leaves only noise, no more than the typical inexactness of formulas is allowed for the
    smaller explanation. For example, a creep whose residual was 70 times the noise (3.6 % of the explained change)
    imitated a ratio and an offset, which together leave only noise.
    """
    rows = state.problem.rows
    joins, noise_alone = set(smaller.names) <= set(larger.names), larger.score - rows < NOISY * rows**0.5
    share = len(smaller.names) * (FORM_SHARE if noise_alone and not joins else SMALL_SHARE)
    # What the runs' offsets explain beside the larger explanation, they explain in all of them.
    metric = state.problem.offsets.metric(larger.sigma_mm)
    without, left, rest = (state.problem.offsets.squared(e.residual, metric) for e in (state.nothing, smaller, larger))
    return left - rest > share**2 * (without - left)


@dataclass(frozen=True, slots=True, eq=False)
class SearchState:
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
    imitation: str | None = None
    unknown: str | None = None
    left_over: str | None = None


def noise_known(problem_beside: Callable[[Explanation | None], Problem], known: Explanation | None) -> SearchState:
    """Estimate the noise from the residual of the known effects, or of effects from a rough first search."""
    if known is not None:
        problem = problem_beside(known)
        nothing = problem.nothing()
        return SearchState(problem, signatures(problem), nothing, nothing, [nothing], shapes_of(problem))
    problem = problem_beside(None)
    changed = changes(problem)
    atoms = changed.whitened(problem)
    rough = single_effects(problem, atoms, 4, ROUGH, ROUGH_EFFECTS)
    # A pair that is fitted to few samples absorbs their noise, so that the noise would be underestimated.
    many = problem.chain.history.input_mm.size >= SHORT
    pairs = extended(problem, atoms, rough[:3], 16, lambda _: None, scanned=1, refined=ROUGH) if many else []
    first = [*rough[:1], *pairs[:1]]
    if first:
        problem = problem_beside(min(first, key=lambda e: e.bic))
        atoms = changed.whitened(problem)
    nothing = problem.nothing()
    return SearchState(problem, atoms, nothing, nothing, [nothing], shapes_of(problem))

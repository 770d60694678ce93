"""Result of a completed search, and the settings of searches."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fingervision.diagnosis.inference.ambiguity_set import choices
from fingervision.diagnosis.inference.explanation_candidates import Progress
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import MANY_STEPS, fit
from fingervision.diagnosis.inference.model_adequacy import VERY_STRONG
from fingervision.diagnosis.inference.random_effect import estimated_coefficients
from fingervision.diagnosis.inference.reference_gauge import consistent_with_gauges
from fingervision.diagnosis.inference.search import search
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.input.observations import PATH, Observations
from fingervision.domain.effect import Flags

QUIET = 3.0 * 2.0**0.5
"""Deficit of chi-square relative to the number of rows n, in units of sqrt(n), above which the assumed noise was too
large: three standard deviations sqrt(2 n) of chi-square."""
MOST_REPEATS = 2
"""Largest number of repeated searches with a smaller noise: with the right effects, the estimate of the noise hardly
changes any more."""


def problem_of(data: Observations, explanation: Explanation | None) -> Problem:
    """Estimation problem whose noise is estimated from an explanation's residual, or else from the disagreement."""
    if explanation is None:
        return data.problem(data.stacked_mm - data.chain.stacked({}), 0, explained=False)
    values, free = explanation.values, explanation.free
    residual_mm = data.stacked_mm - data.chain.stacked(values)
    problem = data.problem(residual_mm, free, explained=True, values=values)
    columns_mm = data.path_errors_mm(values)
    if not columns_mm.shape[1]:
        return problem
    # What the errors of the path explain is no noise of the picture.
    left = problem.measured - problem.whitened(values)
    beside = replace(explanation, residual=left, sigma_mm=problem.offsets.spread(left)[0])
    errors, _ = estimated_coefficients(problem, beside, columns_mm.shape[1], data.behind(PATH))
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
        look = partial(search, partial(problem_of, data), self.rng, self.forced, self.progress)
        found = look(known)
        if _fits_far_better(data, found):
            found = look(found.nearest)
        for _ in range(MOST_REPEATS):
            if not _noise_is_too_large(found):
                break
            found = look(found.best)
        found, said = consistent_with_gauges(data, found)
        return Searched(data, found, said)


def _fits_far_better(data: Observations, found: Findings) -> bool:
    """Whether an explanation that was not accepted is far more probable, each with the noise of its own residual.

    If the noise is estimated from the residual of too few effects, the missing effect counts as correlated noise, and
    its gain cannot exceed this noise. Therefore the likelihoods are compared with each explanation's own noise, with
    the penalties of BIC (Schwarz 1978) and for the choice among all explanations. For example, a play of seven standard
    deviations in 60 rows beside an offset gained only 65 in chi-square over a drift.
    """
    nearest, best, problem = found.nearest, found.best, found.problem
    if not nearest.names or nearest.names == best.names or nearest.bic(problem.measured.size) > best.score:
        return False
    if data.measured_pure_errors(np.split(problem.whitener.aside, len(data.channels))) is not None:
        return False
    (own, own_rows), (other, other_rows) = _likelihood_cost(data, nearest), _likelihood_cost(data, best)
    same_rows = bool(np.array_equal(own_rows, other_rows))
    return same_rows and other - own + choices(problem, best) - choices(problem, nearest) > VERY_STRONG


def _likelihood_cost(data: Observations, explanation: Explanation) -> tuple[float, Flags]:
    """BIC of an explanation with the noise of its own residual, and the rows that were set aside for it."""
    problem, names = problem_of(data, explanation), explanation.names
    again = fit(problem, names, explanation.values, iterations=MANY_STEPS) if names else problem.nothing()
    _, determinant = problem.whitener.columns(problem.measured[:, None])
    return again.bic(problem.measured.size) + determinant, problem.whitener.aside


def _noise_is_too_large(found: Findings) -> bool:
    """Whether the result leaves a residual far smaller than the noise by which it was judged.

    The noise is estimated from the residual of a rough first fit. If the first fit is poor, its errors count as
    correlated noise, and a second effect cannot be found because the assumed noise is too large.
    """
    rows = int(found.problem.measured.size - found.problem.whitener.aside.sum())
    return bool(found.best.score < rows - QUIET * rows**0.5)


def refitted(state: Searched) -> Searched:
    """Refit the best explanation with the noise and the random effects that belong to it."""
    problem, best = problem_of(state.data, state.found.best), state.found.best
    refit = fit(problem, best.names, best.values, iterations=20) if best.names else best
    return replace(state, found=state.found.with_best(refit, problem))

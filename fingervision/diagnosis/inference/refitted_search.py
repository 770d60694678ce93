"""Search for effects and refit the uncertain dimensions of the drawing alternately, until both agree."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.stats import t as student

from fingervision.diagnosis.inference.explanation_candidates import Progress
from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.map_imitators import imitating_effects, imitating_parts
from fingervision.diagnosis.inference.map_repeatability import foretells_other_passes
from fingervision.diagnosis.inference.position_map import (
    NAME,
    PositionMap,
    likeliest_map,
    why_no_map,
)
from fingervision.diagnosis.inference.posterior import settled
from fingervision.diagnosis.inference.random_effect import LEAST_GAIN
from fingervision.diagnosis.inference.reference_gauge import consistent_with_gauges
from fingervision.diagnosis.inference.run_gains import FEWEST_RUNS, RunGains, likeliest_gains
from fingervision.diagnosis.inference.search import Findings, search
from fingervision.diagnosis.inference.verdict import standing_of, with_simpler_parts, without_unneeded_effects
from fingervision.diagnosis.input.intersample_interpolation import likelier_interpolation
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.whitening import RunOffsets

BY_ACCIDENT = 1e-3
"""Probability by which the runs' offsets have a mean so far from zero by accident (Student's t), below which they share
a cause."""
LOWERED = 0.9
"""Times what stands that an answer with such a cause must leave at most."""
MOST_SEARCHES = 3
"""The second is nearly always the last, and none is needed where the drawing's numbers act along a straight line."""


@dataclass(frozen=True, slots=True, eq=False)
class Refitted:
    """Result of the search, with the measurement compared to the refitted gripper.

    Parameters
    ----------
    data : Observations
        Measurement and model; the drawing's uncertain numbers stand where they explain the most.
    found : Findings
        What the search found.
    posterior : tuple of dict
        Draws of the best explanation's parameters.
    """

    data: Observations
    found: Findings
    posterior: tuple[Point, ...]


def _problem_of(data: Observations, explanation: Explanation | None) -> Problem:
    values = {} if explanation is None else explanation.values
    free = 0 if explanation is None else explanation.free
    return data.problem(data.stacked_mm - data.chain.stacked(values), free, explained=explanation is not None)


def refitted_search(
    data: Observations,
    rng: np.random.Generator,
    forced: frozenset[str],
    without: frozenset[str],
    progress: Progress,
) -> Refitted:
    """Search in stages: interpolation between samples, a map of position errors, run gains, a redrawn gripper.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    rng : numpy Generator
        For the bootstrap and the posterior.
    forced, without : frozenset of str
        Effects that the user insists on, or rules out.
    progress : callable
        Told the share that is done.
    """
    look = _Look(rng, forced, progress)
    state = look.again(data)
    likelier = likelier_interpolation(state.data, state.found.problem, state.found.best)
    if likelier is not state.data:
        state = look.again(likelier)
    state = _over_the_ends(state, look)
    state = _beside_gains(state, look)
    if NAME not in without:
        state = _beside_map(state, look)
    state = _common_offset(state, look)
    return _settled(_beside_drawing(state, look), rng)


@dataclass(frozen=True, slots=True, eq=False)
class _Searched:
    """A finished search: measurement and model, its findings, and what reference slots showed."""

    data: Observations
    found: Findings
    said: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """Settings of a search."""

    rng: np.random.Generator
    forced: frozenset[str]
    progress: Progress

    def again(self, data: Observations, known: Explanation | None = None) -> _Searched:
        """Search again, with the noise re-estimated with the known effects removed."""
        found = search(partial(_problem_of, data), self.rng, self.forced, self.progress, known)
        found, said = consistent_with_gauges(data, found)
        return _Searched(data, found, said)


def _over_the_ends(state: _Searched, look: _Look) -> _Searched:
    """Search along a path with overshoots, and keep the result where an effect with memory then fits better."""
    data = state.data.with_overshoots()
    if data is state.data:
        return state
    found = state.found
    with_memory = [name for name, effect in found.problem.effects.items() if effect.memory]
    over = replace(found.problem, chain=data.chain)
    tried = [e for e in found.singles if e.names[0] in with_memory]
    straight = min(e.score for e in [found.nothing, *tried])
    refits = [fit(over, e.names, e.values, iterations=20).score for e in tried]
    turned = min([over.nothing().score, *refits])
    return look.again(data) if turned < straight - LEAST_GAIN else state


def _beside_gains(state: _Searched, look: _Look) -> _Searched:
    """Search with gains that differ from run to run, and keep the result where it is far more probable.

    Such gains are nuisance parameters if a named effect does more than they do; without one they are structure with no
    name.
    """
    found = state.found
    explained = found.unknown is None and standing_of(state.data, found).is_little
    if explained or len(state.data.chain.history.runs) < FEWEST_RUNS:
        return state
    tried = [likeliest_gains(found.problem, one) for one in (found.best, *found.singles[:3])]
    gains, gain = max(tried, key=lambda one: one[1])
    if gain < LEAST_GAIN:
        return state
    known = found.best if found.best.names else None
    beside = look.again(replace(state.data, run_gains=gains), known)
    stands = standing_of(beside.data, beside.found)
    if not stands.is_little:
        # What all runs share is an effect, and was taken for their scatter.
        apart = look.again(replace(state.data, run_gains=gains.without_mean()), known)
        if standing_of(apart.data, apart.found).after_mm < stands.after_mm:
            beside = apart
    if not _does_more(beside):
        return state
    return beside if _gained(state, beside, gains) > LEAST_GAIN else state


def _does_more(beside: _Searched) -> bool:
    """Whether the named effects change the prediction by more than the scatter of the runs' gains does."""
    best, gains = beside.found.best, beside.data.run_gains
    if gains is None or not best.names:
        return False
    scatter_mm = gains.refitted(beside.found.problem, best, beside.data.behind(gains)).scatter_mm
    changed_mm = beside.data.chain.stacked(best.values) - beside.data.chain.stacked({})
    return bool(np.linalg.norm(changed_mm) > np.linalg.norm(scatter_mm))


def _beside_map(state: _Searched, look: _Look) -> _Searched:
    """Search with a map of position errors, and keep the result where it is far more probable.

    The map is considered only where the other effects leave a residual, and its freedom is penalised; an effect with a
    few parameters that does as well is kept.
    """
    history, found = state.data.chain.history, state.found
    reason = why_no_map(history, state.data.chain.path)
    asked = NAME in look.forced
    if reason is not None:
        excluded = {**state.data.excluded, NAME: reason}
        return replace(state, data=replace(state.data, excluded=excluded))
    if not asked and found.unknown is None:
        return state
    first, gain = likeliest_map(found.problem, found.best)
    if gain < LEAST_GAIN and found.best.names:
        # What was named may itself stand for a part of the map.
        first, gain = likeliest_map(found.problem, found.nothing)
    if gain < LEAST_GAIN and not asked:
        return state
    imitating = imitating_effects(found.problem, first)
    kept = found.best if not set(found.best.names) & set(imitating) else None
    beside = look.again(_excluding(replace(state.data, position_map=first), imitating), kept)
    plain = _without(beside.found.problem, first)
    parts = imitating_parts(plain, first, beside.found.best)
    if parts and not parts.keys() & look.forced:
        # The map was estimated beside what stands for a part of it.
        names = tuple(name for name in beside.found.best.names if name not in parts)
        rest = fit(plain, names, beside.found.best.values, iterations=20) if names else plain.nothing()
        first, _ = likeliest_map(plain, rest)
        beside = look.again(_excluding(replace(beside.data, position_map=first), parts))
        plain = _without(beside.found.problem, first)
    rest = _left(plain, beside.found.best)
    second, _ = likeliest_map(plain, rest)
    if not (asked or foretells_other_passes(plain, rest, second)):
        return state
    if first.is_like(second):
        second = first
    else:
        beside = look.again(replace(beside.data, position_map=second), beside.found.best)
    return beside if asked or _gained(state, beside, second) > LEAST_GAIN else state


def _excluding(data: Observations, reasons: dict[str, str]) -> Observations:
    """Exclude effects from the search, each with its reason."""
    kept = {name: effect for name, effect in data.effects.items() if name not in reasons}
    return replace(data, effects=kept, excluded={**data.excluded, **reasons})


def _gained(state: _Searched, beside: _Searched, effect: RunGains | PositionMap) -> float:
    """Decrease of -2 log likelihood by a random effect and the findings with it, minus its penalty."""
    best = state.found.best
    plain = replace(_without(beside.found.problem, effect), effects=state.found.problem.effects)
    rows = max(2, int(plain.measured.size - plain.whitener.aside.sum()))
    rival = fit(plain, best.names, best.values, iterations=20) if best.names else plain.nothing()
    return rival.bic(rows) - beside.found.best.bic(rows) - effect.price


def _common_offset(state: _Searched, look: _Look) -> _Searched:
    """Search again for a constant common to all runs, which run offsets had absorbed.

    Runs with nearly the same offset share a cause; the spread of their offsets is then limited to their departure from
    the mean.
    """
    runs = len(state.data.chain.history.runs)
    found = state.found
    if runs < 2 or max(found.best.sigma_mm) == 0.0:
        return state
    offsets = found.problem.offsets
    means = (offsets.metric(found.best.sigma_mm) @ (offsets.design.T @ found.best.residual))[:runs]
    scatter = float(np.std(means, ddof=1))
    chance = 2.0 * float(student.sf(abs(means.mean()) / max(scatter / np.sqrt(runs), 1e-300), runs - 1))
    stands = standing_of(state.data, found)
    if chance > BY_ACCIDENT and stands.is_little:
        return state
    again = look.again(replace(state.data, runs_scatter_mm=scatter), found.best)
    lower = standing_of(again.data, again.found).after_mm
    return again if lower < LOWERED * stands.after_mm else state


def _left(problem: Problem, explanation: Explanation) -> Explanation:
    """Judge a fixed explanation under another model of the observations."""
    residual = problem.measured - problem.whitened(explanation.values)
    return replace(explanation, residual=residual, sigma_mm=problem.offsets.spread(residual)[0])


def _without(problem: Problem, effect: RunGains | PositionMap) -> Problem:
    """Return the problem without a random effect's columns, which are the first ones if it was added last."""
    count, drawing = effect.coefficients.size, problem.whitener.drawing
    kept = None if drawing is None or drawing.shape[1] == count else drawing[:, count:]
    return replace(problem, offsets=RunOffsets.of(replace(problem.whitener, drawing=kept)))


def _beside_drawing(state: _Searched, look: _Look) -> _Searched:
    """Refit the uncertain dimensions of the drawing, and search again, until neither changes the other."""
    if not state.data.refit.moved:
        return state
    for _ in range(MOST_SEARCHES - 1):
        nearer = state.data.redrawn(state.found.problem, state.found.best)
        straight = nearer.straight(state.data, state.found.problem)
        state = replace(state, data=nearer)
        if straight:
            break
        state = look.again(state.data)
    found = replace(state.found, problem=_problem_of(state.data, state.found.best))
    refit = fit(found.problem, found.best.names, found.best.values, iterations=20) if found.best.names else found.best
    return replace(state, found=_with_best(found, refit))


def _settled(state: _Searched, rng: np.random.Generator) -> Refitted:
    """Drop unneeded effects, estimate the map and the gains, and compute every parameter's posterior."""
    data, found = state.data, without_unneeded_effects(state.data, state.found)
    found = with_simpler_parts(data, found)
    best, posterior = settled(found.problem, found.best, rng)
    found = _with_best(found, best)
    if data.position_map is not None:
        data = replace(
            data, position_map=data.position_map.refitted(found.problem, best, data.behind(data.position_map))
        )
    if data.run_gains is not None:
        gains = data.run_gains.refitted(found.problem, best, data.behind(data.run_gains))
        data = replace(data, run_gains=gains, notes=(*data.notes, gains.words))
    if data.refit.moved:
        data = data.redrawn(found.problem, best if best.names else found.problem.nothing())
        found = replace(found, problem=_problem_of(data, best))
    return Refitted(replace(data, notes=(*data.notes, *state.said)), found, posterior)


def _with_best(found: Findings, best: Explanation) -> Findings:
    others = tuple(best if explanation is found.best else explanation for explanation in found.alternatives)
    return replace(found, best=best, alternatives=others)

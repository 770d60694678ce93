"""Search for effects and refit the drawing's uncertain dimensions alternately, until neither changes the other."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.inference.explanation_candidates import Progress, single_effects
from fingervision.diagnosis.inference.held_out_prediction import needed
from fingervision.diagnosis.inference.hypothesis import Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.position_map import NAME, map_columns, set_points
from fingervision.diagnosis.inference.posterior import beside_alternatives
from fingervision.diagnosis.inference.random_effect import LEAST_GAIN
from fingervision.diagnosis.inference.random_effect_search import beside_gains, beside_map
from fingervision.diagnosis.inference.record_errors import settled_with_records
from fingervision.diagnosis.inference.search_state import ROUGH, Findings
from fingervision.diagnosis.inference.searched import Look, Searched, problem_of, refitted
from fingervision.diagnosis.inference.signatures import signatures
from fingervision.diagnosis.inference.turning_places import beside_turns
from fingervision.diagnosis.input.intersample_interpolation import likelier_interpolation
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.run_offsets import RunOffsets

MOST_SEARCHES = 3
"""Most searches: the second search is nearly always the last, and no repetition is needed if the prediction depends
linearly on the drawing's dimensions."""


@dataclass(frozen=True, slots=True, eq=False)
class Refitted:
    """Result of the search, with the measurement compared to the gripper with refitted dimensions.

    Parameters
    ----------
    data : Observations
        Measurement and model, with the uncertain dimensions at the values that explain most.
    found : Findings
        Findings of the search.
    posterior : tuple of dict
        Posterior draws of the best explanation's parameters.
    """

    data: Observations
    found: Findings
    posterior: tuple[Point, ...]


def refitted_search(
    data: Observations,
    rng: np.random.Generator,
    forced: frozenset[str],
    without: frozenset[str],
    progress: Progress,
) -> Refitted:
    """Search; repeat it with curved interpolation, a position map, gains of runs, and refitted dimensions.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    rng : numpy Generator
        Generator for bootstrap and posterior.
    forced, without : frozenset of str
        Effects that the user requires, or excludes.
    progress : callable
        Called with the share of the work that is done.
    """
    look = Look(rng, forced, progress)
    state = beside_turns(look.again(data), look)
    likelier = likelier_interpolation(state.data, state.found.problem, state.found.best)
    if likelier is not state.data:
        state = look.again(likelier)
    state = _over_the_ends(state, look)
    state = beside_gains(state, look)
    if NAME not in without:
        state = beside_map(state, look)
    return _settled(_beside_drawing(state, look), look)


def _over_the_ends(state: Searched, look: Look) -> Searched:
    """Search along a path that includes overshoots, if an effect with memory then fits better beside a free curve.

    Both paths pass the same positions, so that no curve over the position depends on where the stage turned. Without
    the curve, a map of position errors that is larger than the play decides instead.
    """
    data, found = state.data.with_overshoots(), state.found
    if data is state.data:
        return state
    history, drawn = found.problem.chain.history, found.problem.whitener.drawing
    curve_mm = map_columns(found.problem.chain, set_points(history)) * history.input_span_mm
    beside = np.hstack([curve_mm, *([] if drawn is None else [drawn])])
    problem = replace(found.problem, offsets=RunOffsets.of(replace(found.problem.whitener, drawing=beside)))
    along = _with_memory_score(replace(problem, chain=data.chain), found)
    return look.again(data) if along < _with_memory_score(problem, found) - LEAST_GAIN else state


def _with_memory_score(problem: Problem, found: Findings) -> float:
    """Best score of an effect with memory, which depends on where the stage turned, alone and beside other effects."""
    acting = {name: effect for name, effect in problem.effects.items() if effect.memory}
    if not acting:
        return np.inf
    only = replace(problem, effects=acting)
    alone = single_effects(only, signatures(only), 7, ROUGH)
    lasting = [e for e in found.singles if problem.effects[e.names[0]].needs_times and e.names[0] not in acting]
    bases = {e.names: e.values for e in (found.best, found.nearest, *lasting) if e.names}
    starts = [{**values, **one.values} for values in bases.values() for one in alone]
    return min(e.score for e in [*alone, *(fit(problem, tuple(start), start, iterations=7) for start in starts)])


def _beside_drawing(state: Searched, look: Look) -> Searched:
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
    return refitted(state)


def _settled(state: Searched, look: Look) -> Refitted:
    """Drop unneeded effects, estimate the map and the gains, and compute every parameter's posterior."""
    data, found = state.data, state.found
    if not look.forced & set(found.best.names):
        found = needed(data, found)
    best, posterior = settled_with_records(data, found.problem, found.best, look.rng)
    found = found.with_best(beside_alternatives(found.problem, best, found.alternatives))
    if data.position_map is not None:
        data = replace(
            data, position_map=data.position_map.refitted(found.problem, best, data.behind(data.position_map))
        )
    if data.run_gains is not None:
        gains = data.run_gains.refitted(found.problem, best, data.behind(data.run_gains))
        data = replace(data, run_gains=gains, notes=(*data.notes, gains.words))
    if data.refit.moved:
        data = data.redrawn(found.problem, best if best.names else found.problem.nothing())
        found = replace(found, problem=problem_of(data, best))
    return Refitted(replace(data, notes=(*data.notes, *state.said)), found, posterior)

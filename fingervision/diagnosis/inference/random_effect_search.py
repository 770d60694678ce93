"""Search with a random effect added: gains that differ from run to run, or a map of position errors."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from typing import TypeVar

import numpy as np

from fingervision.diagnosis.inference.evidence import PATHS, STRONG, TWICE, rms
from fingervision.diagnosis.inference.explanation_candidates import different
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit, refit
from fingervision.diagnosis.inference.map_identifiability import (
    foretells_other_passes,
    imitating_effects,
)
from fingervision.diagnosis.inference.position_map import NAME, PositionMap, likeliest_map, why_no_map
from fingervision.diagnosis.inference.random_effect import FEWEST_RUNS, LEAST_GAIN, RunGains, likeliest_gains
from fingervision.diagnosis.inference.search import Look, Searched, problem_of
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.inference.verdict import standing_of
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.record_nuisances import below_the_input

BESIDE = 3
"""Number of the most probable single effects with which run gains and maps are tried; each costs a hundredth of a
search."""
ROUNDS = 2
"""Rounds in which effects and random effect are fitted alternately; the second round changes both only little."""

Effected = TypeVar("Effected", bound=RunGains | PositionMap)


def beside_gains(state: Searched, look: Look) -> Searched:
    """Search with gains that differ between runs, and keep the result if it is much more probable.

    If a named effect changes the prediction more than the gains of the runs do, the gains are nuisance parameters. If
    the gains of the runs change the prediction more than every named effect, the gains are reported as structure
    without a name. If effects are not 20 times as probable as gains that differ between runs, the gains are kept,
    because naming an effect claims more than stating a scatter. The gains have no common mean: a mean within their
    scatter is no ratio, and the interval of a ratio beside them contains it.
    """
    found = state.found
    if len(state.data.chain.history.runs) < FEWEST_RUNS:
        return state
    explained = found.unknown is None and standing_of(state.data, found).is_little
    if explained and not found.best.names:
        return state
    # Effects are named at odds of 20:1 against gains.
    least = -STRONG if explained else LEAST_GAIN
    others = () if explained else (_line(found.problem), *found.singles[:BESIDE])
    likelier = _likelier(found, likeliest_gains, least, others)
    if likelier is None:
        return state
    known, gains = likelier
    if explained:
        seen = replace(state.data, run_gains=gains)
        best = found.nothing if known is None else known
        if not standing_of(seen, replace(found, best=best, problem=problem_of(seen, best))).is_little:
            return state
    beside = look.again(replace(state.data, run_gains=gains), known)
    left = standing_of(beside.data, beside.found)
    # If runs stay at one position, their gains are only offsets and can have any value. The remaining residuals are
    # therefore compared as well.
    if not left.is_little and left.after_mm > standing_of(state.data, found).after_mm:
        return state
    fewer = len(beside.found.best.names) < len(found.best.names)
    gained = _gained(state, beside, gains)
    if _does_more(beside):
        return beside if gained > (least if fewer else LEAST_GAIN) else state
    return _unrepeatable(state, beside) if gained > -STRONG and (fewer or not explained) else state


def _unrepeatable(state: Searched, beside: Searched) -> Searched:
    """Name nothing if gains of the runs explain the table, and effects beside them hardly change the prediction."""
    gains = beside.data.run_gains
    if gains is None or not standing_of(beside.data, beside.found).is_little:
        return state
    each = gains.refitted(beside.found.problem, beside.found.best).each
    words = f"gains that differ from run to run (by {each}) are as probable as any effect"
    found = replace(state.found, best=state.found.problem.nothing(), alternatives=(), unknown=words)
    return replace(state, found=found)


def beside_map(state: Searched, look: Look) -> Searched:
    """Search with a map of position errors included, and keep the result if it is much more probable.

    The map is tried only if the other effects leave an unexplained residual, and with a penalty for its flexibility; if
    an effect with a few parameters fits as well, the effect is kept.
    """
    found, reason = state.found, why_no_map(state.data.chain.along.history)
    asked = NAME in look.forced
    if reason is not None:
        excluded = {**state.data.excluded, NAME: reason}
        return _contested(replace(state, data=replace(state.data, excluded=excluded)), reason)
    known: Explanation | None = found.best
    if not asked and found.unknown is None:
        stands = not standing_of(state.data, found).is_noise
        likelier = _likelier(found, likeliest_map, LEAST_GAIN, _acting_in_time(found) if stands else ())
        if likelier is None:
            return state
        known, first = likelier
        if known is not None and set(found.best.names) <= set(known.names):
            # The map replaces none of the effects: it only describes the inexactness of their formulas.
            return state
    else:
        first, gain = likeliest_map(found.problem, found.best)
        if gain < LEAST_GAIN and found.best.names:
            # A named effect may represent a part of the map.
            first, gain = likeliest_map(found.problem, found.nothing)
        if gain < LEAST_GAIN and not asked:
            return state
    # What the user requires stays beside the map, even if the map could represent it.
    imitating = {n: why for n, why in imitating_effects(found.problem, first).items() if n not in look.forced}
    kept = known if known is not None and not set(known.names) & set(imitating) else None
    beside = look.again(_excluding(replace(state.data, position_map=first), imitating), kept)
    plain = beside.found.problem.without_first(first.coefficients.size)
    if asked:
        return beside
    if not foretells_other_passes(plain, plain.judged(beside.found.best, beside.found.best.values), first):
        return state
    if below_the_input(plain, rms(first.fitted_mm)) or _follows_the_log(beside.found, first):
        # If a stage returns to the same positions, its encoder rounds them equally; these errors are no effect.
        return state
    # If effects explain the data and the map replaces none of them, the map only describes the inexactness of their
    # formulas.
    stays = found.unknown is None and set(found.best.names) <= set(beside.found.best.names)
    worse = found.unknown is None and beside.found.unknown is not None
    return beside if not (stays or worse) and _gained(state, beside, first) > LEAST_GAIN else state


def _follows_the_log(found: Findings, position_map: PositionMap) -> bool:
    """Whether a map changes the prediction no more than the maps that errors of the log alone would cause."""
    problem, best = found.problem, found.best
    alone, caused = problem.chain.stacked(best.values), []
    for chain in islice(problem.other_paths(), PATHS):
        moved = replace(problem, measured=problem.measured + problem.whitener.one(chain.stacked(best.values) - alone))
        caused.append(position_map.refitted(moved, moved.judged(best, best.values)).fitted_mm)
    own_mm = position_map.refitted(problem, best).fitted_mm
    return bool(caused) and rms(own_mm) < TWICE * rms(np.array(caused) - own_mm)


def _contested(state: Searched, reason: str) -> Searched:
    """Name no effect that an unknown curve over the input, far more probable, replaces; keep those beside the curve.

    Such a curve has no name where the table does not show whether it is repeatable, but it may be the cause. For
    example, a drive that sags under gravity, driven one way for six seconds, was taken for a creep of 16 s. A curve
    beside the same effects only describes what they leave.
    """
    found = state.found
    acting = {name for name in found.best.names if found.problem.effects[name].memory}
    # A partial cause that depends on the position alone is itself such a curve.
    if not (found.best.names if found.unknown is None else acting) or standing_of(state.data, found).is_noise:
        return state
    likelier = _likelier(found, likeliest_map, LEAST_GAIN, _acting_in_time(found))
    if likelier is None:
        return state
    known, curve = likelier
    if known is not None and known.names == found.best.names:
        return state
    beside = "" if known is None else f" beside {' and '.join(known.names)}"
    words = (
        f"a curve over the input of {1e3 * curve.rms_mm.value:.2g} um RMS{beside} is far more probable than "
        f"{' and '.join(found.best.names)}, but {reason}"
    )
    part = found.problem.nothing() if known is None else refit(found.problem, known)
    kept = (part,) if part.names else ()
    return replace(state, found=replace(found, best=part, alternatives=kept, unknown=words))


def _likelier(
    found: Findings,
    estimated: Callable[[Problem, Explanation], tuple[Effected, float]],
    least: float,
    others: Sequence[Explanation] = (),
) -> tuple[Explanation | None, Effected] | None:
    """Find few effects plus a random effect that gain `least` over the present best explanation, or return None.

    Two or three effects can imitate a random effect, such as a map measured from one side only, or runs of different
    gain. `others` are further explanations with which the random effect is tried.
    """
    problem = found.problem
    singles = different(problem, list(found.singles), BESIDE)
    tried = []
    begins = (found.nothing, _line(problem), *singles, *([found.best] if least > 0.0 else []))
    # What is not more probable must claim less.
    fewer = [e for e in begins if len(e.names) + (least < 0.0) <= len(found.best.names)]
    for begin in {e.names: e for e in (*others, *fewer)}.values():
        known, (effect, _) = begin, estimated(problem, begin)
        for _ in range(ROUNDS):
            # Refit the effects, because the random effect now explains what they imitated.
            known = refit(problem.beside(effect.columns_mm), known)
            effect, _ = estimated(problem, problem.judged(known, known.values))
        known = refit(problem.beside(effect.columns_mm), known)
        tried.append((known.bic + effect.price, known, effect))
    cost, known, effect = min(tried, key=lambda one: one[0])
    rival = found.best if least < 0.0 else min(found.best, found.nearest, key=lambda e: e.bic)
    if cost > rival.bic - least:
        return None
    return (known if known.names else None), effect


def _line(problem: Problem, beside: Explanation | None = None) -> Explanation:
    """Fit a straight line over the input, as an offset of the gap and a ratio if both effects can be named.

    A map of position errors contains no straight line. The line may be fitted beside an effect.
    """
    names = tuple(name for name in ("rest_gap_error", "lever_ratio_error") if name in problem.effects)
    begin = {**({} if beside is None else beside.values), **{name: {} for name in names}}
    return fit(problem, tuple(begin), begin, iterations=5)


def _acting_in_time(found: Findings) -> list[Explanation]:
    """Each effect with memory beside a straight line: a map together with a loop or a lag is the rule for a stage.

    Alone, such an effect fits badly, and is not among the most probable ones, if the map is the larger part.
    """
    problem = found.problem
    return [_line(problem, e) for e in found.singles if problem.effects[e.names[0]].memory]


def _does_more(beside: Searched) -> bool:
    """Whether the named effects change the prediction by more than the scatter of the runs' gains."""
    best, gains = beside.found.best, beside.data.run_gains
    if gains is None or not best.names:
        return False
    scatter_mm = gains.refitted(beside.found.problem, best).fitted_mm
    changed_mm = beside.data.chain.stacked(best.values) - beside.data.chain.stacked({})
    return bool(np.linalg.norm(changed_mm) > np.linalg.norm(scatter_mm))


def _gained(state: Searched, beside: Searched, effect: RunGains | PositionMap) -> float:
    """Decrease of -2 log likelihood by a random effect and the effects found with it, minus the penalty for it."""
    plain = replace(beside.found.problem.without_first(effect.coefficients.size), effects=state.found.problem.effects)
    rivals = [refit(plain, one) for one in (state.found.best, state.found.nearest)]
    return min(rival.bic for rival in rivals) - beside.found.best.bic - effect.price


def _excluding(data: Observations, reasons: dict[str, str]) -> Observations:
    """Exclude effects from the search, and record the reason for each."""
    kept = {name: effect for name, effect in data.effects.items() if name not in reasons}
    return replace(data, effects=kept, excluded={**data.excluded, **reasons})

"""The whole diagnosis: locate the disagreement, name the missing effects, and assess the residual."""

import time
from dataclasses import dataclass, field, replace

import numpy as np

from calib.short_repr import ShortRepr
from fingervision.diagnosis.bodies.body_evidence import BodyEvidence
from fingervision.diagnosis.bodies.place_diagnosis import diagnose_with_bodies, without_places
from fingervision.diagnosis.inference.clock_shift import beside_clock
from fingervision.diagnosis.inference.explanation_candidates import Progress, single_effects
from fingervision.diagnosis.inference.held_out_prediction import foretold
from fingervision.diagnosis.inference.hypothesis import Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.inference.plausibility import (
    UNRELATED,
    mistaken_beside_effects,
    mistaken_column,
    mixed_rows,
    swapped_directions,
)
from fingervision.diagnosis.inference.position_map import NAME, map_columns, set_points
from fingervision.diagnosis.inference.posterior import beside_alternatives
from fingervision.diagnosis.inference.random_effect import LEAST_GAIN
from fingervision.diagnosis.inference.random_effect_search import beside_gains, beside_map
from fingervision.diagnosis.inference.record_errors import settled_with_records
from fingervision.diagnosis.inference.search import Look, Searched, problem_of, refitted
from fingervision.diagnosis.inference.search_state import ROUGH, Findings
from fingervision.diagnosis.inference.signatures import signatures
from fingervision.diagnosis.inference.turning_places import beside_turns
from fingervision.diagnosis.inference.verdict import judged, without_names
from fingervision.diagnosis.input.intersample_interpolation import likelier_interpolation
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.preparation import prepare
from fingervision.diagnosis.report.diagnosis_report import diagnosis_report
from fingervision.diagnosis.report.positioning_of_data import PositioningReport, positioning_of_data
from fingervision.domain.effect import Array
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.report import DiagnosisReport
from fingervision.effects.trial import EffectAnswerError
from fingervision.models.corrected import CorrectedModel
from fingervision.motion.repeated_targets import NoRepeatedTargets

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
    state = beside_turns(beside_clock(look.again(data), look), look)
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
    history = found.problem.chain.history
    problem = found.problem.beside(map_columns(found.problem.chain, set_points(history)) * history.input_span_mm)
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
    """Estimate the map and the gains, and compute every parameter's posterior."""
    data, found = state.data, state.found
    best, posterior = settled_with_records(data, found.problem, found.best, look.rng)
    found = found.with_best(beside_alternatives(found.problem, best, found.alternatives))
    if data.position_map is not None:
        data = replace(data, position_map=data.position_map.refitted(found.problem, best))
    if data.run_gains is not None:
        gains = data.run_gains.refitted(found.problem, best)
        data = replace(data, run_gains=gains, notes=(*data.notes, gains.words))
    if data.refit.moved:
        data = data.redrawn(found.problem, best if best.names else found.problem.nothing())
        found = replace(found, problem=problem_of(data, best))
    return Refitted(replace(data, notes=(*data.notes, *state.said)), found, posterior)


MOST_DRIVES = 2
"""Number of times that a dynamic model is recomputed with the effects found."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Diagnosis(ShortRepr):
    """The report of a diagnosis, with the arrays for its plots.

    Parameters
    ----------
    report : DiagnosisReport
        Result of the diagnosis.
    data : Observations
        Measurement and model.
    before_mm, after_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted values, without and with the effects found.
    positioning : PositioningReport or NoRepeatedTargets
        Results by ISO 230-2, if the table repeats its target positions.
    bodies : BodyEvidence or None
        Results from the poses of bodies, if there are any.
    left_out : tuple of int
        Isolated outliers, which the verdict does not count.
    answer : Settings
        Everything that the search found: effects with parameters and start states, and the curve of a map.
    """

    report: DiagnosisReport
    data: Observations
    before_mm: Array
    after_mm: Array
    positioning: PositioningReport | NoRepeatedTargets
    bodies: BodyEvidence | None = None
    left_out: tuple[int, ...] = ()
    answer: Settings = field(default_factory=dict)


def diagnose(
    table: MeasuredTable,
    model: CorrectedModel,
    *,
    seed: int = 1,
    forced: frozenset[str] = frozenset(),
    without: frozenset[str] = frozenset(),
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Explain the difference between a measured table and a model by effects of the catalogue.

    Parameters
    ----------
    table : MeasuredTable
        The measured table.
    model : CorrectedModel
        The model, with effects that it already includes.
    seed : int
        Seed of the bootstrap; the same seed gives the same report.
    forced, without : frozenset of str
        Effects that the user requires, or excludes.
    progress : callable
        Called with the share of the work that is done.
    """
    unfit: dict[str, str] = {}
    while True:
        try:
            done = _diagnosed(table, model, seed, forced, without | unfit.keys(), progress)
        except EffectAnswerError as error:
            if error.name in forced or error.name in unfit:
                raise
            unfit[error.name] = error.words
        else:
            excluded = tuple(
                {"name": one["name"], "reason": unfit.get(one["name"], one["reason"])} for one in done.report.excluded
            )
            return replace(done, report=replace(done.report, excluded=excluded)) if unfit else done


def _diagnosed(
    table: MeasuredTable,
    model: CorrectedModel,
    seed: int,
    forced: frozenset[str],
    without: frozenset[str],
    progress: Progress,
) -> Diagnosis:
    """Run a diagnosis once; if an effect of a plug-in fails, the diagnosis ends with an error."""
    table, bare = without_places(table, model)

    def explain(seen: MeasuredTable, by: CorrectedModel) -> Diagnosis:
        return _explained(seen, by, seed, forced, without, progress)

    if not table.channels:
        return explain(table, bare)
    return diagnose_with_bodies(table, bare, explain, np.random.default_rng(seed))


def _explained(
    table: MeasuredTable,
    model: CorrectedModel,
    seed: int,
    forced: frozenset[str],
    without: frozenset[str],
    progress: Progress,
) -> Diagnosis:
    """Explain gap, finger positions and force by effects of the catalogue."""
    begin_s = time.perf_counter()
    rng = np.random.default_rng(seed)
    data = prepare(table, model, without)
    refitted = _searched(data, rng, forced, without, progress)
    data, found = refitted.data, refitted.found
    mistake = _mistake(data, found, Look(rng, frozenset(), lambda _: None))
    if mistake is not None:
        data, found = without_names(data, found, mistake.rstrip("."))
        found = replace(found, left_over=None)
    answered = judged(data, found if forced else foretold(data, found))
    report = diagnosis_report(answered, refitted.posterior, mistake, forced, rng, begin_s)
    progress(1.0)
    answer = answered.values()
    positioning = positioning_of_data(answered.data, answer)
    return Diagnosis(
        report,
        answered.data,
        answered.before_mm,
        answered.after_mm,
        positioning,
        left_out=answered.stands.left_out,
        answer=answer,
    )


def _mistake(data: Observations, found: Findings, look: Look) -> str | None:
    """The question about the table, if a mistake in it explains far more than any effect."""
    rivals = (found.nothing, found.nearest, found.best, *found.singles)
    column = mistaken_column(data, found.problem, rivals)
    if column is None or column == UNRELATED:
        column = mistaken_beside_effects(data, found, look) or column
    asked = column or swapped_directions(data, found.problem, rivals)
    return mixed_rows(data, found.best, found.problem) if asked is None and found.unknown is None else asked


def _searched(
    data: Observations,
    rng: np.random.Generator,
    forced: frozenset[str],
    without: frozenset[str],
    progress: Progress,
) -> Refitted:
    """Search for effects; a dynamic model is recomputed with the effects found, and the search repeated."""
    refitted = refitted_search(data, rng, forced, without, progress)
    for _ in range(MOST_DRIVES):
        noise_mm = min(noise.total_mm for noise in refitted.found.problem.whitener.noises)
        again = refitted.data.driven_again(refitted.found.best, noise_mm)
        if again is None:
            break
        refitted = refitted_search(again, rng, forced, without, progress)
    return refitted

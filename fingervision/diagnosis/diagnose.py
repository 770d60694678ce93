"""The whole diagnosis: locate the disagreement, name the missing effects, and assess the residual."""

import time
from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import BodyEvidence
from fingervision.diagnosis.bodies.place_diagnosis import diagnose_with_bodies, without_places
from fingervision.diagnosis.inference.explanation_candidates import Progress
from fingervision.diagnosis.inference.held_out_prediction import foretold
from fingervision.diagnosis.inference.plausibility import mistaken_column, mixed_rows, swapped_directions
from fingervision.diagnosis.inference.refitted_search import Refitted, refitted_search
from fingervision.diagnosis.inference.verdict import judged, without_names
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

MOST_DRIVES = 2
"""Number of times that a dynamic model is recomputed with the effects found."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
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
    """

    report: DiagnosisReport
    data: Observations
    before_mm: Array
    after_mm: Array
    positioning: PositioningReport | NoRepeatedTargets
    bodies: BodyEvidence | None = None
    left_out: tuple[int, ...] = ()


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
    rivals = (found.nothing, found.nearest, found.best, *found.singles)
    mistake = mistaken_column(data, found.problem, rivals) or swapped_directions(data, found.problem, rivals)
    if mistake is None and found.unknown is None:
        mistake = mixed_rows(data, found.best, found.problem)
    if mistake is not None and mistake.blocks:
        data, found = without_names(data, found, mistake.words.rstrip("."))
        found = replace(found, left_over=None)
    answered = judged(data, found if forced else foretold(data, found))
    report = diagnosis_report(answered, refitted.posterior, mistake, forced, rng, begin_s)
    progress(1.0)
    positioning = positioning_of_data(answered.data, answered.values())
    return Diagnosis(
        report,
        answered.data,
        answered.before_mm,
        answered.after_mm,
        positioning,
        left_out=answered.stands.left_out,
    )


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

"""The whole loop: where they disagree, which effect is missing, how much it explains, what remains."""

import time
from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import BodyEvidence
from fingervision.diagnosis.bodies.place_diagnosis import diagnose_with_bodies, without_places
from fingervision.diagnosis.design.further_evidence import further_evidence
from fingervision.diagnosis.design.next_run import next_run
from fingervision.diagnosis.inference.cross_validation import left_out_rms_mm, rms_mm
from fingervision.diagnosis.inference.explanation_candidates import Progress
from fingervision.diagnosis.inference.hypothesis_fit import Problem
from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.inference.plausibility import gross_mistake, swapped_directions
from fingervision.diagnosis.inference.position_map import NAME
from fingervision.diagnosis.inference.refitted_search import refitted_search
from fingervision.diagnosis.inference.search import Findings
from fingervision.diagnosis.inference.verdict import standing, verdict
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.preparation import prepare
from fingervision.diagnosis.input.repeated_targets import NoRepeatedTargets
from fingervision.diagnosis.noise.replicates import PureError, resolution
from fingervision.diagnosis.report.force_hint import force_hint
from fingervision.diagnosis.report.positioning_of_data import positioning_of_data
from fingervision.diagnosis.report.positioning_report import PositioningReport
from fingervision.diagnosis.report.residual_localization import where
from fingervision.diagnosis.report.sentences import answer, input_dominates, outliers, remaining, rows_beyond_model
from fingervision.domain.effect import Array
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import DiagnosisReport, Disagreement, NamedEffect, Place
from fingervision.effects import catalogue
from fingervision.effects.trial import EffectAnswerError
from fingervision.models.corrected import CorrectedModel

MEMBERS_SEPARATED = 5
"""Explanations, best first, that the next run is designed to separate: the time it takes grows with their square."""

MOST_DRIVES = 2
"""Times that a model which is a function of time is driven again behind the effects that were found."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """The report with the arrays that its figures are drawn from.

    Parameters
    ----------
    report : DiagnosisReport
        The answer.
    data : Observations
        Measurement and model.
    before_mm, after_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted, without and with the answer.
    positioning : PositioningReport or NoRepeatedTargets
        Figures of ISO 230-2 where the table repeats its targets.
    bodies : BodyEvidence or None
        What the poses of bodies say, where there are any.
    """

    report: DiagnosisReport
    data: Observations
    before_mm: Array
    after_mm: Array
    positioning: PositioningReport | NoRepeatedTargets
    bodies: BodyEvidence | None = None


def by_channel(data: Observations, stacked: Array) -> dict[str, Array]:
    """Split a stacked residual into gap and, where they were measured, left, right and midline."""
    n = data.chain.history.input_mm.size
    gap = stacked[:n]
    out = {"gap": gap}
    if data.chain.history.both_edges:
        midline = stacked[n : 2 * n] - np.median(stacked[n : 2 * n])
        out |= {"left": midline - 0.5 * gap, "right": midline + 0.5 * gap, "midline": midline}
    if data.chain.history.force:
        out["force"] = stacked[-n:]
    return out


def places(data: Observations, problem: Problem, residual: Array, rng: np.random.Generator) -> tuple[Place, ...]:
    """Say where a residual cannot be noise."""
    noises = dict(zip(data.channels, problem.whitener.noises, strict=True))
    n = data.chain.history.input_mm.size
    aside = problem.whitener.aside[:n]
    return where(by_channel(data, residual), noises, data.chain.history, aside, rng)


def diagnose(
    table: MeasuredTable,
    model: CorrectedModel,
    *,
    seed: int = 1,
    forced: frozenset[str] = frozenset(),
    without: frozenset[str] = frozenset(),
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Explain a measured table by a model and the catalogue's effects.

    Parameters
    ----------
    table : MeasuredTable
        Measurement.
    model : CorrectedModel
        Model, with the effects that it already has.
    seed : int
        Of the bootstrap; the same seed gives the same report.
    forced, without : frozenset of str
        Effects that the user insists on, or rules out.
    progress : callable
        Told the share that is done.
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
    """Diagnose once; an effect from elsewhere that fails on the way ends it."""
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
    """Explain the gap, the fingers and the force by the catalogue."""
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    data = prepare(table, model, without)
    mistake = gross_mistake(data)
    refitted = refitted_search(data, rng, forced, without, progress)
    for _ in range(MOST_DRIVES):
        # A model that is a function of time answers to the path behind what was found.
        noise_mm = min(noise.total_mm for noise in refitted.found.problem.whitener.noises)
        again = refitted.data.driven_again(refitted.found.best, noise_mm)
        if again is None:
            break
        refitted = refitted_search(again, rng, forced, without, progress)
    data, found = refitted.data, refitted.found
    if mistake is None and (found.unknown is not None or not found.best.names):
        mistake = swapped_directions(data, found.problem)
    if mistake is not None and mistake.blocks:
        nothing = found.problem.nothing()
        found = replace(found, best=nothing, alternatives=(), unknown=mistake.words.rstrip("."), left_over=None)
        data = replace(data, position_map=None, run_gains=None)
    before = data.stacked_mm - data.chain.stacked({})
    after = data.stacked_mm - data.chain.stacked(_values(data, found))
    stands = standing(data, found.problem, before, after)
    digit = resolution(data.table.gap_mm) if data.recorded.commanded else 0.0
    n, edges = data.chain.history.input_mm.size, data.chain.history.both_edges
    larger = stands.after_mm > stands.before_mm or rms_mm(after, n, edges) > rms_mm(before, n, edges)
    if larger or stands.before_mm < digit:
        # What makes the disagreement larger, outliers included, explains nothing, and less than the digit of a reading
        # that stands still is its rounding, the same in every hold.
        unknown = None if stands.before_mm < digit else found.unknown
        found = replace(found, best=found.problem.nothing(), alternatives=(), unknown=unknown)
        data = replace(data, position_map=None, run_gains=None)
        after, stands = before, standing(data, found.problem, before, before)
    mapped = data.position_map is not None
    decided, unknown = verdict(found, mapped=mapped, stands=stands)
    best = found.best
    unseen = left_out_rms_mm(data, found.problem, best)
    channels = {
        name: {
            f"before_rms_{_unit(name)}": float(np.sqrt(np.mean(a**2))),
            f"after_rms_{_unit(name)}": float(np.sqrt(np.mean(b**2))),
        }
        for (name, a), b in zip(by_channel(data, before).items(), by_channel(data, after).values(), strict=True)
    }
    noises = [noise.total_mm for noise in found.problem.whitener.noises]
    noise_rms = float(np.sqrt(0.25 * noises[0] ** 2 + noises[1] ** 2)) if edges else noises[0]
    disagreement = Disagreement(rms_mm(before, n, edges), rms_mm(after, n, edges), noise_rms, *unseen, channels)
    effects = _named(data, found)
    errors = data.measured_pure_errors(np.split(found.problem.whitener.aside, len(data.channels)))
    members = tuple(e for e in found.alternatives if e.names)
    alternatives = tuple(_with_map(e.names, mapped=mapped) for e in members) or (((NAME,),) if mapped else ())
    proposal = next_run(data, found.problem, list(members[:MEMBERS_SEPARATED]), refitted.posterior, rng)
    report = DiagnosisReport(
        verdict=decided,
        sentence=answer(decided, unknown, effects, alternatives, disagreement),
        effects=effects,
        alternatives=alternatives,
        where=places(data, found.problem, before, rng),
        disagreement=disagreement,
        explained_share=stands.explained_share,
        standing_share=stands.share,
        pure_error_mm=None if errors is None else errors[0].sd_mm,
        smallest_seen=found.smallest,
        unknown=unknown,
        remaining=remaining(stands, found.left_over, best.sigma_mm),
        next_run=proposal,
        excluded=tuple({"name": name, "reason": reason} for name, reason in data.excluded.items()),
        outliers=outliers(data, found.problem, after),
        runners_up=tuple(
            {
                "effects": list(e.names),
                "chi_square_more_than_best": e.score - best.score,
                "distance": found.distances.get(e.names),
            }
            for e in found.singles[:8]
            if e.names != best.names
        ),
        notes=(
            *data.notes,
            *data.refitted(),
            *(() if mistake is None else (mistake.words,)),
            *_trend(errors),
            *force_hint(data, found.alternatives),
            *further_evidence(found.alternatives),
            *rows_beyond_model(data, best),
            *input_dominates(data, found.problem),
        ),
        seconds=time.perf_counter() - begin,
    )
    progress(1.0)
    return Diagnosis(report, data, before, after, positioning_of_data(data, _values(data, found)))


def _values(data: Observations, found: Findings) -> Settings:
    """Everything that was found: the effects, and the curve of a map."""
    if data.position_map is None:
        return found.best.values
    return {**found.best.values, NAME: data.position_map.values()}


def _with_map(names: tuple[str, ...], *, mapped: bool) -> tuple[str, ...]:
    return tuple(name for name in catalogue() if name in names or (mapped and name == NAME))


def _trend(errors: list[PureError] | None) -> tuple[str, ...]:
    """Say that repeats follow one another closer than they scatter: a drift, or a run-in."""
    if errors is None or not errors[0].has_trend:
        return ()
    return (
        "repeats of the same place drift or run in (neighbouring visits agree better than distant ones, by "
        f"{errors[0].trend_sigmas:.1f} standard deviations): that was taken out of the pure error.",
    )


def _unit(channel: str) -> str:
    return "n" if channel == "force" else "mm"


def _named(data: Observations, found: Findings) -> tuple[NamedEffect, ...]:
    listed = [entry for entry in found.problem.parameters(found.best.names) if entry[1].run is None]
    root = np.sqrt(np.maximum(np.diag(found.best.covariance), 0.0))
    out = {}
    for name in found.best.names:
        known = {
            parameter.name: Estimate(
                found.best.values[name][parameter.name], float(root[i]) if root[i] > 0.0 else None, parameter.unit
            )
            for i, (owner, parameter) in enumerate(listed)
            if owner == name
        }
        effect = found.problem.effects[name]
        # What these data cannot show stays at the value at which it does nothing.
        still = {p.name: Estimate(p.neutral or 0.0, None, p.unit) for p in effect.parameters if p.name not in known}
        ordered = {p.name: {**known, **still}[p.name] for p in effect.parameters}
        shown = {p.name: p.words for p in (*effect.parameters, *(p for owner, p in listed if owner == name))}
        out[name] = NamedEffect(name, str(effect.stage), {**ordered, **known}, shown=shown)
    curve = data.position_map
    if curve is not None:
        described = {"rms_mm": curve.rms_mm, "length_mm": curve.length_mm}
        points = tuple(zip(curve.nodes_mm.tolist(), curve.curve_mm.tolist(), strict=True))
        entry = catalogue()[NAME]
        shown = {p.name: p.words for p in entry.parameters}
        out[NAME] = NamedEffect(NAME, str(entry.stage), described, points, shown=shown)
    return tuple(out[name] for name in catalogue() if name in out)

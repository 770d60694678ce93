"""The report of a diagnosis, composed from its result."""

import time

import numpy as np

from fingervision.diagnosis.design.further_evidence import further_evidence
from fingervision.diagnosis.design.next_run import next_run
from fingervision.diagnosis.inference.answer import Answer
from fingervision.diagnosis.inference.cross_validation import left_out_rms_mm, rms_mm
from fingervision.diagnosis.inference.hypothesis import Point
from fingervision.diagnosis.inference.plausibility import Finding
from fingervision.diagnosis.inference.position_map import NAME
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.inference.verdict import verdict
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.replicates import PureError
from fingervision.diagnosis.report.dead_band_hint import dead_band_hint
from fingervision.diagnosis.report.encoder_zero import encoder_zero
from fingervision.diagnosis.report.force_hint import force_hint
from fingervision.diagnosis.report.left_out_rows import outlier_rows, outliers
from fingervision.diagnosis.report.open_parameters import draws_of, limited, open_parameters
from fingervision.diagnosis.report.residual_channels import by_channel, places
from fingervision.diagnosis.report.sentences import (
    answer,
    beyond_the_search,
    input_dominates,
    remaining,
    rows_beyond_model,
)
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import DiagnosisReport, Disagreement, NamedEffect
from fingervision.effects import catalogue

MEMBERS_SEPARATED = 5
"""Number of explanations, best first, that the next run is designed to separate; the computing time grows with its
square."""

RUNNERS_UP = 8
"""Number of single effects, best first, that a report lists in addition to its result."""


def diagnosis_report(
    answered: Answer, posterior: tuple[Point, ...], mistake: Finding | None, rng: np.random.Generator, begin_s: float
) -> DiagnosisReport:
    """Compose the report of a result, with its evidence and the next run.

    Parameters
    ----------
    answered : Answer
        Findings, and the remaining share of the disagreement.
    posterior : tuple of dict
        Posterior draws of the best explanation's parameters, for predicting the next run.
    mistake : Finding or None
        Mistake found in the table itself.
    rng : numpy.random.Generator
        Generator of the bootstrap.
    begin_s : float
        Start time of the diagnosis, on the clock of `time.perf_counter`.
    """
    data, found, stands = answered.data, answered.found, answered.stands
    best, mapped = found.best, data.position_map is not None
    decided, unknown = verdict(found, mapped=mapped, stands=stands)
    disagreement = _disagreement(answered)
    rows = outlier_rows(data, found.problem, answered.after_mm, stands.left_out)
    effects = _named(data, found, posterior)
    errors = data.measured_pure_errors(np.split(found.problem.whitener.aside, len(data.channels)))
    members = tuple(e for e in found.alternatives if e.names)
    alternatives = tuple(_with_map(e.names, mapped=mapped) for e in members) or (((NAME,),) if mapped else ())
    proposal = next_run(data, found.problem, list(members[:MEMBERS_SEPARATED]), posterior, rng)
    return DiagnosisReport(
        verdict=decided,
        sentence=answer(decided, unknown, effects, alternatives, disagreement),
        effects=effects,
        alternatives=alternatives,
        where=places(data, found.problem, answered.before_mm, rng),
        disagreement=disagreement,
        explained_share=stands.explained_share,
        standing_share=stands.share,
        pure_error_mm=None if errors is None else errors[0].sd_mm,
        smallest_seen=found.smallest,
        unknown=unknown,
        remaining=remaining(stands, found.left_over, best.sigma_mm),
        next_run=proposal,
        excluded=tuple({"name": name, "reason": reason} for name, reason in data.excluded.items()),
        outliers=outliers(data, found.problem, rows, answered.after_mm),
        outlier_rows=rows,
        runners_up=tuple(
            {
                "effects": list(e.names),
                "chi_square_more_than_best": e.score - best.score,
                "distance": found.distances.get(e.names),
            }
            for e in found.singles[:RUNNERS_UP]
            if e.names != best.names
        ),
        notes=(
            *data.notes,
            *data.refitted(),
            *(() if mistake is None else (mistake.words,)),
            *_trend(errors),
            *force_hint(data, found.alternatives),
            *further_evidence(found.alternatives),
            *beyond_the_search(best, found.problem),
            *rows_beyond_model(data, best),
            *input_dominates(data, found.problem),
            *encoder_zero(answered),
            *dead_band_hint(data, answered.before_mm, decided),
        ),
        seconds=time.perf_counter() - begin_s,
    )


def _disagreement(answered: Answer) -> Disagreement:
    """Disagreement without and with the named effects: over all rows, by channel, and over the rows of the verdict."""
    data, found = answered.data, answered.found
    before, after = answered.before_mm, answered.after_mm
    n, edges = data.chain.history.input_mm.size, data.chain.history.both_edges
    channels = {
        name: {
            f"before_rms_{_unit(name)}": float(np.sqrt(np.mean(a**2))),
            f"after_rms_{_unit(name)}": float(np.sqrt(np.mean(b**2))),
        }
        for (name, a), b in zip(by_channel(data, before).items(), by_channel(data, after).values(), strict=True)
    }
    unseen = left_out_rms_mm(data, found.problem, found.best)
    stands = answered.stands
    return Disagreement(
        rms_mm(before, n, edges),
        rms_mm(after, n, edges),
        stands.noise_mm,
        *unseen,
        channels,
        counted_before_rms_mm=stands.before_mm,
        counted_after_rms_mm=stands.after_mm,
        rows=n,
        rows_left_out=len(stands.left_out),
        of="edges" if edges else "gap",
    )


def _with_map(names: tuple[str, ...], *, mapped: bool) -> tuple[str, ...]:
    return tuple(name for name in catalogue() if name in names or (mapped and name == NAME))


def _trend(errors: list[PureError] | None) -> tuple[str, ...]:
    """Sentence for repeated readings that change gradually, which indicates a drift or a run-in."""
    if errors is None or not errors[0].has_trend:
        return ()
    return (
        "repeated readings at the same position drift or run in (neighbouring visits agree better than distant "
        f"visits, by {errors[0].trend_sigmas:.1f} standard deviations): this trend was subtracted from the pure error.",
    )


def _unit(channel: str) -> str:
    return "n" if channel == "force" else "mm"


def _named(data: Observations, found: Findings, posterior: tuple[Point, ...]) -> tuple[NamedEffect, ...]:
    listed = [entry for entry in found.problem.parameters(found.best.names) if entry[1].run is None]
    root = np.sqrt(np.maximum(np.diag(found.best.covariance), 0.0))
    open_ended = dict(open_parameters(found.best, found.problem))
    out = {}
    for name in found.best.names:
        known = {
            parameter.name: Estimate(
                found.best.values[name][parameter.name], float(root[i]) if root[i] > 0.0 else None, parameter.unit
            )
            for i, (owner, parameter) in enumerate(listed)
            if owner == name
        }
        if name in open_ended:
            far = draws_of(posterior, name, open_ended[name].name)
            known = {
                p.name: limited(known[p.name].value, p, draws_of(posterior, name, p.name), far)
                for owner, p in listed
                if owner == name
            }
        effect = found.problem.effects[name]
        # Parameters that these data cannot show keep their neutral value.
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

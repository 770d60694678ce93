"""Combine the diagnosis from the poses of bodies and the diagnosis from the gap into one report."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import (
    BodyEvidence,
)
from fingervision.diagnosis.bodies.next_view import next_view
from fingervision.diagnosis.bodies.place_findings import Fitted
from fingervision.diagnosis.bodies.place_words import set_words
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import NamedEffect, Verdict
from fingervision.effects import catalogue
from fingervision.models.place_answers import PlaceAnswers

if TYPE_CHECKING:
    from fingervision.diagnosis.diagnose import Diagnosis


def measured_bodies(done: "Diagnosis", evidence: BodyEvidence) -> "Diagnosis":
    """Add the channels' results to the tables of a report: disagreement by channel, detection limits by place."""
    report, findings = done.report, evidence.findings
    channels: dict[str, Mapping[str, float]] = dict(report.disagreement.by_channel)
    for place, name in enumerate(evidence.names):
        unit = "mrad" if name.endswith("_mrad") else "mm"
        kept = findings.noise.kept
        channels[name] = {
            f"before_rms_{unit}": float(np.sqrt(np.mean(findings.before[kept, place] ** 2))),
            f"after_rms_{unit}": float(np.sqrt(np.mean(findings.after[kept, place] ** 2))),
        }
    smallest = dict(report.smallest_seen) | {
        key: {"parameter": candidate.parameter.name, "size": size, "unit": candidate.parameter.unit}
        for key, (candidate, size) in findings.smallest.items()
        if candidate.place and size <= candidate.parameter.upper
    }
    disagreement = replace(report.disagreement, by_channel=channels)
    return replace(done, report=replace(report, disagreement=disagreement, smallest_seen=smallest), bodies=evidence)


def composed(
    first: "Diagnosis", second: "Diagnosis", evidence: BodyEvidence, answers: PlaceAnswers, notes: tuple[str, ...]
) -> "Diagnosis":
    """Combine the diagnosis from poses and the diagnosis from the gap into one report."""
    members, rest = evidence.findings.members, second.report
    best = members[0]
    keys = list(dict.fromkeys(member.candidate.key for member in members))
    beside = rest.alternatives or ((),)
    alternatives = tuple((key, *names) for key in keys for names in beside)
    verdict = Verdict.NAMED
    if rest.verdict is Verdict.UNKNOWN:
        verdict = Verdict.UNKNOWN
    elif len(alternatives) > 1:
        verdict = Verdict.AMBIGUOUS
    before, after = first.report.disagreement, rest.disagreement
    disagreement = replace(
        after,
        before_rms_mm=before.before_rms_mm,
        unseen_before_rms_mm=before.unseen_before_rms_mm,
        by_channel=before.by_channel,
        counted_before_rms_mm=before.counted_before_rms_mm,
    )
    before_mm, after_mm = disagreement.counted_mm
    share = float(np.clip(1.0 - (after_mm / max(before_mm, 1e-300)) ** 2, 0.0, 1.0))
    view = next_view(evidence, answers)
    said = set_words(members)
    sentence = f"The poses of the bodies show the place: {said} (95 %)."
    if len(keys) > 1:
        sentence = f"The poses of the bodies leave these places possible: {said} (95 % each)."
    if rest.verdict is not Verdict.AGREES:
        sentence += f" In addition: {rest.sentence}"
    report = replace(
        rest,
        verdict=verdict,
        sentence=sentence,
        effects=(_named(best), *rest.effects),
        alternatives=alternatives,
        where=first.report.where,
        disagreement=disagreement,
        explained_share=share,
        standing_share=float(np.sqrt(1.0 - share)),
        runners_up=first.report.runners_up,
        notes=(*rest.notes, *notes, *(() if view is None else (f"next view: {view.words}",))),
        seconds=first.report.seconds + rest.seconds,
    )
    return replace(second, report=report, data=first.data, before_mm=first.before_mm)


def _named(best: Fitted) -> NamedEffect:
    candidate = best.candidate
    estimates = {candidate.parameter.name: Estimate(best.size, best.u_stated, candidate.parameter.unit)}
    for parameter in catalogue()[candidate.name].parameters:
        estimates.setdefault(parameter.name, Estimate(parameter.neutral or 0.0, None, parameter.unit))
    shown = {p.name: p.words for p in (*catalogue()[candidate.name].parameters, candidate.parameter)}
    return NamedEffect(candidate.name, str(catalogue()[candidate.name].stage), estimates, (), candidate.place,
                       candidate.detail, shown)  # fmt: skip

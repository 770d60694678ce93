"""Combine the diagnosis from the poses of bodies and the diagnosis from the gap into one report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_evidence import GAP, BodyEvidence
from fingervision.diagnosis.bodies.body_prediction import FORCE, BodyPrediction
from fingervision.diagnosis.bodies.place_candidates import candidates_of
from fingervision.diagnosis.bodies.place_findings import Fitted
from fingervision.diagnosis.bodies.place_search import ALIKE
from fingervision.diagnosis.bodies.place_words import set_words
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import NamedEffect, Verdict
from fingervision.effects import catalogue
from fingervision.models.place_answers import PlaceAnswers

if TYPE_CHECKING:
    from fingervision.diagnosis.diagnose import Diagnosis


Array = NDArray[np.float64]

ASSUMED = {"_mm": 0.001, "mrad": 0.05, "ce_n": 0.01}
"""Assumed standard uncertainty of a reading of a proposed view, if no similar quantity was measured: a pose of a link
of 15 mm at 34 px/mm; a load cell with 0.2 % of 5 N."""
MOST_MEMBERS = 6
"""Number of explanations, best first, that a view must separate (six explanations form 15 pairs); the computing time
grows with the square of this number."""


@dataclass(frozen=True, slots=True)
class NextView:
    """A proposed additional view that would distinguish explanations.

    Parameters
    ----------
    channels : tuple of str
        Channels to be measured in addition.
    expected : float
        Chi-square by which the view is expected to separate the best explanation from the nearest other one.
    separates : tuple of str
        Explanations that the view is expected to distinguish from the best one.
    words : str
        The proposal as a sentence.
    """

    channels: tuple[str, ...]
    expected: float
    separates: tuple[str, ...]
    words: str


def next_view(evidence: BodyEvidence, answers: PlaceAnswers) -> NextView | None:
    """Choose the view that best separates the explanations of an ambiguity set; None if no view separates them.

    The criterion is the squared whitened distance that a view adds between the best explanation and every other one.
    The size of each other explanation is refitted to the view and the measured data together, with free constants
    (T-optimality: Atkinson and Fedorov (1975), Biometrika 62, 57, DOI 10.1093/biomet/62.1.57).

    Parameters
    ----------
    evidence : BodyEvidence
        Results of comparing the measured channels with the drawing.
    answers : PlaceAnswers
        Predictions of the drawing.
    """
    members = _distinct(evidence.findings.members)[:MOST_MEMBERS]
    if len(members) < 2:
        return None
    best, others = members[0], members[1:]
    full = BodyPrediction(answers, answers.channels, evidence.prediction.input_mm)
    known = {each.full_key: each for each in candidates_of(full)}
    added = {m.candidate.full_key: known[m.candidate.full_key].added(m.size) for m in members}
    found: list[tuple[float, int, NextView]] = []
    for label, channels in _views(answers, evidence):
        columns = [answers.channels.index(name) for name in channels]
        sigma = np.array([_sigma(name, evidence) for name in channels])
        gains = []
        for other in others:
            one = _centred(added[best.candidate.full_key][:, columns]) / sigma
            two = _centred(added[other.candidate.full_key][:, columns]) / sigma
            gains.append(_expected(best, other, one.ravel(), two.ravel()))
        told = tuple(o.candidate.key for o, gain in zip(others, gains, strict=True) if gain > ALIKE)
        if told:
            least = min(gain for gain in gains if gain > ALIKE)
            words = (
                f"measuring {label} as well (u {_stated(channels, sigma)}) is expected to distinguish "
                f"{best.candidate.key} from {' and from '.join(told)} (expected chi-square {least:.0f} or more)."
            )
            found.append((min(gains), len(told), NextView(channels, float(min(gains)), told, words)))
    return max(found, key=lambda entry: (entry[1], entry[0]))[2] if found else None


def _distinct(members: Sequence[Fitted]) -> list[Fitted]:
    first: dict[str, Fitted] = {}
    for member in members:
        first.setdefault(member.candidate.key, member)
    return list(first.values())


def _expected(best: Fitted, other: Fitted, one: Array, two: Array) -> float:
    """Whitened distance of two explanations in measured data plus new view, with the second explanation refitted."""
    norm = float(other.signature @ other.signature + two @ two)
    shared = float(best.signature @ other.signature + one @ two)
    total = float(best.signature @ best.signature + one @ one)
    return total - shared**2 / max(norm, 1e-300)


def _views(answers: PlaceAnswers, evidence: BodyEvidence) -> list[tuple[str, tuple[str, ...]]]:
    """List the views that were not measured yet: poses of bodies, displacements of points, and the force."""
    measured = set(evidence.prediction.channels)
    views: list[tuple[str, tuple[str, ...]]] = []
    for body in answers.moving_bodies:
        names = tuple(f"{body}.{part}" for part in ("x_mm", "y_mm", "angle_mrad"))
        if missing := tuple(name for name in names if name not in measured):
            views.append((f"the pose of {body} (film its edges or put markers on it)", missing))
    for probe in answers.mechanism.probes:
        names = tuple(f"{probe}_{axis}_mm" for axis in "xy")
        if not measured & set(names):
            views.append((f"a marker at {probe}", names))
    views += [("the force at the drive", (FORCE,))] if FORCE not in measured else []
    return views


def _sigma(channel: str, evidence: BodyEvidence) -> float:
    """Noise of a view: the median noise of the measured channels with the same unit."""
    sd = [float(own) for own, name in zip(evidence.findings.noise.sd, evidence.prediction.channels, strict=True)
          if name[-4:] == channel[-4:] and name != GAP]  # fmt: skip
    return float(np.median(sd)) if sd else next(value for end, value in ASSUMED.items() if channel.endswith(end))


def _centred(rows: Array) -> Array:
    return np.asarray(rows - rows.mean(axis=0))


def _stated(channels: Sequence[str], sigma: Array) -> str:
    units = {"mrad": "mrad", "_mm": "mm", "ce_n": "N"}
    said = {next(unit for end, unit in units.items() if c.endswith(end)): f"{s:.2g}"
            for c, s in zip(channels, sigma, strict=True)}  # fmt: skip
    return ", ".join(f"{value} {unit}" for unit, value in said.items())


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

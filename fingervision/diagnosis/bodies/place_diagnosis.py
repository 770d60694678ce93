"""Diagnose a table with poses of bodies: first the faulty hinge or link, then the effects visible in the gap."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import (
    GAP,
    BodyEvidence,
    added_everywhere,
    body_evidence,
    compared_name,
    drawing_of,
)
from fingervision.diagnosis.bodies.body_prediction import FORCE, BodyPrediction, known_channels
from fingervision.diagnosis.bodies.place_candidates import candidates_of
from fingervision.diagnosis.bodies.place_findings import Fitted
from fingervision.diagnosis.bodies.place_search import ALIKE
from fingervision.diagnosis.bodies.place_words import body_places, set_words
from fingervision.diagnosis.design.next_look import CHECK
from fingervision.diagnosis.inference.verdict import STANDING_SHARE
from fingervision.diagnosis.report.sentences import with_unit
from fingervision.domain.effect import Array, DriveEffect, split_key
from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import NamedEffect, Verdict
from fingervision.effects import catalogue
from fingervision.models.corrected import CorrectedModel
from fingervision.models.physical_gripper import GAP as GAP_PAIR
from fingervision.models.place_answers import PlaceAnswers

if TYPE_CHECKING:
    from fingervision.diagnosis.diagnose import Diagnosis

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


Explain = Callable[[MeasuredTable, CorrectedModel], "Diagnosis"]


def without_places(table: MeasuredTable, model: CorrectedModel) -> tuple[MeasuredTable, CorrectedModel]:
    """Subtract from a table those effects of a corrected model that belong to a hinge, link or pivot.

    Raises
    ------
    DataError
        If a place is not in the drawing.
    """
    placed = {key: next(iter(values.values())).value for key, values in model.effects.items() if split_key(key)[1]}
    if not placed:
        return table, model
    answers = drawing_of(model)
    added = None if answers is None else added_everywhere(answers, table.input_mm, placed)
    if answers is None or added is None:
        raise DataError(
            f"Every effect at a hinge or link must name a part that {model.base_path} contains, but "
            f"{' and '.join(placed)} do not: diagnose again, or remove these effects from the model."
        )
    rest = {key: values for key, values in model.effects.items() if key not in placed}
    return _less(table, added, answers), replace(model, effects=rest)


def diagnose_with_bodies(
    table: MeasuredTable, model: CorrectedModel, explain: Explain, rng: np.random.Generator
) -> "Diagnosis":
    """Diagnose a table that contains user-named channels such as poses.

    Parameters
    ----------
    table : MeasuredTable
        Table with channels.
    model : CorrectedModel
        The model, without effects that have a place.
    explain : callable
        Explains the gap of a table by the effects of the catalogue.
    rng : numpy Generator
        Generator for the simulation of thresholds.
    """
    answers = drawing_of(model)
    first = explain(table if answers is None else _beside_condensed(table, model, answers), model)
    if answers is None:
        named = ", ".join(table.channels)
        return _noted(first, (f"{named}: not compared, because the model has no bodies; "
                              "give a gripper.toml or mechanism.toml as --model.",))  # fmt: skip
    driven_mm = _driven_input(first)
    evidence, notes = body_evidence(table, answers, driven_mm, rng)
    if evidence is None:
        return _noted(first, notes)
    findings = evidence.findings
    first = replace(first, report=replace(first.report, where=(*first.report.where, *body_places(evidence, answers))))
    if not findings.members or findings.structure:
        notes = (*notes, _nothing_named(evidence))
        return measured_bodies(_noted(first, notes), evidence)
    best = findings.members[0]
    added = added_everywhere(answers, driven_mm, {best.candidate.full_key: best.size})
    if added is None:
        raise AssertionError(best.candidate.full_key)
    seen = _less(table, added, answers)
    second = explain(_beside_condensed(seen, model, answers), model)
    left_mm, whole_mm = (each.report.disagreement.before_rms_mm for each in (second, first))
    if left_mm < STANDING_SHARE * whole_mm:
        # The formula of an explanation may be inexact by this share: no second cause is named for the remainder.
        second = _place_alone(second)
    return measured_bodies(composed(first, second, evidence, answers, notes), evidence)


def _place_alone(done: "Diagnosis") -> "Diagnosis":
    """Return a diagnosis that names the faulty place only, without effects of the gap."""
    d = done.report.disagreement
    report = replace(
        done.report,
        verdict=Verdict.AGREES,
        effects=(),
        alternatives=(),
        unknown=None,
        next_run=None,
        next_step=CHECK,
        disagreement=replace(
            d,
            after_rms_mm=d.before_rms_mm,
            unseen_after_rms_mm=d.unseen_before_rms_mm,
            counted_after_rms_mm=d.counted_before_rms_mm,
        ),
        remaining=f"The remaining difference is {with_unit(d.before_rms_mm)} RMS: noise, or inexactness "
        "of the explanation's formula.",
    )
    return replace(done, report=report, after_mm=done.before_mm)


def _beside_condensed(table: MeasuredTable, model: CorrectedModel, answers: PlaceAnswers) -> MeasuredTable:
    """Correct the gap for the difference (about 0.1 %) between a model of condensed bodies and a model of bars."""
    u = np.array([0.0, 1.0])
    bare = model.base.respond(u)
    drawn = answers.answer().by_input
    at = answers.channels.index
    apart = float(bare.gap_mm[1] - bare.gap_mm[0]) - float(drawn[at(compared_name(table, answers))])
    changed = replace(table, gap_mm=table.gap_mm + apart * table.input_mm)
    if table.force_n is None or bare.force_n is None:
        return changed
    by_force = float(bare.force_n[1] - bare.force_n[0]) - float(drawn[at(FORCE)])
    return replace(changed, force_n=table.force_n + by_force * table.input_mm)


def _driven_input(done: "Diagnosis") -> Array:
    """Input that the mechanism receives: the recorded input after the drive effects that the poses do not determine."""
    chain = done.data.chain
    history = chain.along.history
    input_mm = history.input_mm
    values = {**chain.fixed, **{e.name: done.answer[e.name] for e in done.report.effects if e.name in done.answer}}
    for name, effect in chain.effects.items():
        if name in values and isinstance(effect, DriveEffect) and not effect.curve and effect.in_drawing is None:
            input_mm = effect.act(input_mm, history, values[name])
    return np.asarray(input_mm[chain.along.rows])


def _less(table: MeasuredTable, added: Mapping[str, Array], answers: PlaceAnswers) -> MeasuredTable:
    """Subtract the changes that an explanation causes from the channels of a table."""
    changes: dict[str, object] = {"gap_mm": table.gap_mm - added[compared_name(table, answers)]}
    if table.midline_mm is not None:
        first, last = answers.mechanism.pairs[GAP_PAIR]
        apart = np.subtract(answers.mechanism.probes[last], answers.mechanism.probes[first])
        way = apart / np.hypot(*apart)
        middle = 0.5 * sum(
            added[f"{probe}_{axis}_mm"] * way[k] for probe in (first, last) for k, axis in enumerate("xy")
        )
        # A picture may show the drawing upside down: the direction in which the midline moves shows whether it does.
        rest = table.midline_mm - np.median(table.midline_mm)
        sign = 1.0 if float(rest @ (middle - middle.mean())) >= 0.0 else -1.0
        changes["midline_mm"] = table.midline_mm - sign * middle
    if table.force_n is not None:
        changes["force_n"] = table.force_n - added[FORCE]
    known = known_channels(answers, tuple(table.channels))
    changes["channels"] = {
        name: replace(channel, value=channel.value - added[known[name]]) if name in known else channel
        for name, channel in table.channels.items()
    }
    return replace(table, **changes)  # type: ignore[arg-type]


def _noted(done: "Diagnosis", notes: tuple[str, ...]) -> "Diagnosis":
    return replace(done, report=replace(done.report, notes=(*done.report.notes, *notes)))


def _nothing_named(evidence: BodyEvidence) -> str:
    compared = ", ".join(evidence.names)
    if evidence.findings.structure:
        return (
            f"poses of bodies ({compared}): they differ from the drawing in a way that no single hinge, link or pivot "
            "explains; the result above is that of the gap alone."
        )
    return (
        f"poses of bodies ({compared}) agree with the drawing: no hinge, link or pivot differs by a detectable amount."
    )

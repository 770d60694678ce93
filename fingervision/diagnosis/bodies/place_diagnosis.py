"""Diagnose a table with poses of bodies: first the faulty hinge or link, then the effects visible in the gap."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_evidence import (
    GAP,
    BodyEvidence,
    added_everywhere,
    body_evidence,
    drawing_of,
)
from fingervision.diagnosis.bodies.body_prediction import FORCE, known_channels
from fingervision.diagnosis.bodies.composed_report import composed, measured_bodies
from fingervision.diagnosis.bodies.place_words import body_places
from fingervision.diagnosis.design.next_look import CHECK
from fingervision.diagnosis.inference.verdict import STANDING_SHARE
from fingervision.domain.effect import DriveEffect, split_key
from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.report import DiagnosisReport, Verdict
from fingervision.models.corrected import CorrectedModel
from fingervision.models.drawn_mechanism import GAP as GAP_PAIR
from fingervision.models.place_answers import PlaceAnswers

if TYPE_CHECKING:
    from fingervision.diagnosis.diagnose import Diagnosis

Array = NDArray[np.float64]
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
    first = replace(first, report=replace(first.report, where=_where(first.report, evidence, answers)))
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
        remaining=f"The remaining difference is {d.before_rms_mm:.3g} mm RMS: noise, or inexactness "
        "of the explanation's formula.",
    )
    return replace(done, report=report, after_mm=done.before_mm)


def _beside_condensed(table: MeasuredTable, model: CorrectedModel, answers: PlaceAnswers) -> MeasuredTable:
    """Correct the gap for the difference (about 0.1 %) between a model of condensed bodies and a model of bars."""
    u = np.array([0.0, 1.0])
    bare = model.base.respond(u)
    drawn = answers.answer().by_input
    at = answers.channels.index
    apart = float(bare.gap_mm[1] - bare.gap_mm[0]) - float(drawn[at(GAP)])
    changed = replace(table, gap_mm=table.gap_mm + apart * table.input_mm)
    if table.force_n is None or bare.force_n is None:
        return changed
    by_force = float(bare.force_n[1] - bare.force_n[0]) - float(drawn[at(FORCE)])
    return replace(changed, force_n=table.force_n + by_force * table.input_mm)


def _driven_input(done: "Diagnosis") -> Array:
    """Input that the mechanism receives: the recorded input after the drive effects that the poses do not determine."""
    chain = done.data.chain
    history = chain.history if chain.path is None else chain.path.history
    input_mm = history.input_mm
    values = {**chain.fixed, **{e.name: {n: p.value for n, p in e.parameters.items()} for e in done.report.effects}}
    for name, effect in chain.effects.items():
        if name in values and isinstance(effect, DriveEffect) and not effect.curve and effect.in_drawing is None:
            input_mm = effect.act(input_mm, history, values[name])
    return np.asarray(input_mm if chain.path is None else input_mm[chain.path.rows])


def _less(table: MeasuredTable, added: Mapping[str, Array], answers: PlaceAnswers) -> MeasuredTable:
    """Subtract the changes that an explanation causes from the channels of a table."""
    changes: dict[str, object] = {"gap_mm": table.gap_mm - added[GAP]}
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


def _where(report: DiagnosisReport, evidence: BodyEvidence, answers: PlaceAnswers) -> tuple:  # type: ignore[type-arg]
    return (*report.where, *body_places(evidence, answers))

"""report.html: the whole result on one self-contained HTML page."""

from collections.abc import Sequence
from html import escape

import numpy as np

from fingervision.diagnosis.bodies.body_evidence import drawing_of
from fingervision.diagnosis.diagnose import Diagnosis
from fingervision.diagnosis.inference.verdict import SCATTERED, UNDECIDED
from fingervision.diagnosis.report.figure_files import effect_residual
from fingervision.diagnosis.report.html_parts import (
    HINT,
    Chart,
    GapCurves,
    bullets,
    charts_html,
    charts_of,
    effect_charts,
    gap_curves,
    named,
    number,
    page,
    provenance_html,
    table,
    with_uncertainty,
)
from fingervision.diagnosis.report.mechanism_sketch import sketch_html
from fingervision.diagnosis.report.positioning_of_data import positioning_html
from fingervision.diagnosis.report.report_parts import added_sections
from fingervision.diagnosis.report.residual_localization import by_channel
from fingervision.diagnosis.report.sentences import EDGES, QUESTION
from fingervision.domain.report import DiagnosisReport, Disagreement, Verdict
from fingervision.effects import catalogue
from fingervision.storage.provenance import Provenance

HEADINGS = {
    Verdict.AGREES: "Measurement and model agree",
    Verdict.NAMED: "What the model lacks has a name",
    Verdict.AMBIGUOUS: "More than one explanation fits",
    Verdict.UNKNOWN: "No effect of the catalogue explains the difference",
}
IN_PART = "A part of the difference has a name, the rest has none"
UNEXPLAINED = {
    SCATTERED: "The table scatters too much to tell",
    UNDECIDED: "The table does not show its own noise",
    QUESTION: "A question about the table comes before any name",
}
"""Headings of an *unknown* result by the beginning of its sentence."""
NOWHERE = "<p>Nowhere significantly.</p>"
SIMULATION: str = "simulation"
CORRECTED: str = "corrected model"


def curves_of(diagnosis: Diagnosis, name: str = SIMULATION) -> GapCurves:
    """Curves of measurement, simulation and, if effects were named, the corrected model."""
    data = diagnosis.data
    predictions = {name: data.stacked_mm - diagnosis.before_mm}
    if diagnosis.report.effects:
        predictions[CORRECTED if name == SIMULATION else f"{name}, corrected"] = data.stacked_mm - diagnosis.after_mm
    return gap_curves(data, diagnosis.report.disagreement.noise_rms_mm, predictions)


def report_page(diagnosis: Diagnosis, made: Provenance, frames: str, measurement: Sequence[str] = ()) -> str:
    """Compose the report as HTML.

    Parameters
    ----------
    diagnosis : Diagnosis
        Result of the diagnosis.
    made : Provenance
        Files, command and versions.
    frames : str
        HTML of the frames at the reversals.
    measurement : sequence of str
        Sentences on the measurement: its clocks, and the uncertainty of the gap.
    """
    report = diagnosis.report
    before, after = (by_channel(diagnosis.data, mm) for mm in (diagnosis.before_mm, diagnosis.after_mm))
    residuals = {
        channel: {SIMULATION: values, **({CORRECTED: after[channel]} if report.effects else {})}
        for channel, values in before.items()
    }
    charts = charts_of(curves_of(diagnosis), residuals, diagnosis.left_out)
    for effect in report.effects:
        if effect.name in catalogue():
            charts += effect_charts(effect.name, *effect_residual(effect.name))
    parameters = [
        [named(effect.name), escape(effect.display_name(name)), *with_uncertainty(e)]
        for effect in report.effects
        for name, e in effect.parameters.items()
    ]
    told = "What explains a part" if report.verdict is Verdict.UNKNOWN else "What was named"
    sections = [
        ("Gap against input", f'{charts_html(charts, "gap-")}<p class="hint">{HINT}</p>'),
        ("Where they disagree", bullets([place.words for place in report.where]) if report.where else NOWHERE),
        ("Difference before and after", charts_html(charts, "residual-")),
        ("At the turning points", frames),
        ("How much", _how_much(report)),
        (told, _mechanisms(report, charts)),
        ("Parameters", table(["effect", "parameter", "value", "U (k = 2)"], parameters)),
        ("Explanations that these data cannot distinguish", _apart(report.alternatives)),
        ("The next run", f"<p>{escape(report.next_step)}</p>"),
        ("What was tried: each effect alone", _runners_up(report)),
        ("What remains", f"<p>{escape(report.remaining)}</p>"),
        ("Set aside", bullets(list(report.outliers))),
        ("Smallest size that these data would have shown (detection limit)", _detection_limits(report)),
        ("Effects that these data cannot show", bullets([f"{e['name']}: {e['reason']}" for e in report.excluded])),
        *([("How the gap was measured", bullets(measurement))] if measurement else []),
        ("Notes", bullets(list(report.notes))),
        *added_sections(diagnosis),
        ("Where this comes from", provenance_html(made)),
    ]
    answers = drawing_of(diagnosis.data.model) if diagnosis.bodies is not None else None
    if diagnosis.bodies is not None and answers is not None:
        sections.insert(1, ("The mechanism, measured and predicted", sketch_html(diagnosis.bodies, answers)))
    positioning = positioning_html(diagnosis.positioning)
    if positioning is not None:
        sections.insert(7, ("Positioning accuracy and repeatability (ISO 230-2)", positioning))
    return page(f"fingervision: {report.verdict}", _heading(report), report.sentence, sections, charts)


def _heading(report: DiagnosisReport) -> str:
    """Heading that fits verdict and sentence."""
    for beginning, heading in UNEXPLAINED.items():
        if report.sentence.startswith(beginning):
            return heading
    return IN_PART if report.verdict is Verdict.UNKNOWN and report.effects else HEADINGS[report.verdict]


def _how_much(report: DiagnosisReport) -> str:
    d = report.disagreement
    unseen = ["runs left out of the fit", number(d.unseen_before_rms_mm), number(d.unseen_after_rms_mm)]
    rows = [
        [_counted(d), *(number(rms_mm) for rms_mm in d.counted_mm)],
        ["all rows", number(d.before_rms_mm), number(d.after_rms_mm)],
        *([] if d.unseen_before_rms_mm is None else [unseen]),
        ["random noise", number(d.noise_rms_mm), ""],
        ["scatter of repeats (pure error)", number(report.pure_error_mm), ""],
    ]
    share = f'<data value="{report.explained_share!r}">{100.0 * report.explained_share:.1f}</data> %'
    return (
        table([f"disagreement{EDGES if d.of == 'edges' else ' of the gap'}, RMS", "before", "after"], rows)
        + f"<p>The named effects explain {share} of the squared disagreement (first line of the table).</p>"
    )


def _counted(d: Disagreement) -> str:
    """Sentence with the rows and offsets that the verdict takes into account."""
    offsets = "" if d.unseen_before_rms_mm is None else ", without the runs' own offsets"
    return f"counted: {d.rows - d.rows_left_out} of {d.rows} rows{offsets}"


def _mechanisms(report: DiagnosisReport, charts: Sequence[Chart]) -> str:
    """Each named effect in words, with its formula, its source and its typical residual."""
    if not report.effects:
        return "<p>Nothing.</p>"
    known = catalogue()
    return "".join(
        f"<h3>{escape(effect.name)}</h3><p>{escape(known[effect.name].words.capitalize())}: "
        f"<code>{escape(known[effect.name].formula)}</code> ({escape(known[effect.name].source)}). Its "
        f"residual (measured minus simulated): {escape(known[effect.name].residual)}.</p>"
        + charts_html(charts, f"effect-{effect.name}-")
        for effect in report.effects
        if effect.name in known
    )


def _apart(alternatives: Sequence[Sequence[str]]) -> str:
    """List of the explanations in the ambiguity set."""
    if len(alternatives) < 2:
        return "<p>None: no other explanation of the catalogue fits nearly as well.</p>"
    return bullets([" + ".join(names) for names in alternatives])


def _runners_up(report: DiagnosisReport) -> str:
    rows = [
        [
            escape(" + ".join(str(name) for name in runner["effects"])),  # type: ignore[attr-defined]
            f"{100.0 * float(str(runner['explained_share'])):.0f} %",
            f"{runner['chi_square_more_than_best']:.1f}",
            "far" if runner["distance"] is None else f"{runner['distance']:.1f}",
        ]
        for runner in report.runners_up
    ]
    head = ["effect", "share that it explains alone", "chi-square behind", "distance from the best explanation"]
    return table(head, rows)


def _detection_limits(report: DiagnosisReport) -> str:
    rows = [
        [named(name), named(f"{entry['parameter']}"), number(float(np.float64(entry["size"])), f"{entry['unit']}", 3)]  # type: ignore[arg-type]
        for name, entry in report.smallest_seen.items()
    ]
    return table(["effect", "parameter", "size"], rows)

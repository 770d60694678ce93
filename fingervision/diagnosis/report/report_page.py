"""report.html: the whole answer on one self-contained page."""

import base64
import math
from collections.abc import Sequence
from html import escape

from fingervision.diagnosis.diagnose import Diagnosis, by_channel
from fingervision.diagnosis.report.positioning_of_data import positioning_html
from fingervision.diagnosis.report.residual_figure import residual_figure
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import DiagnosisReport, Verdict

COVERAGE_FACTOR = 1.96
"""Standard uncertainties in half a 95 % interval."""

STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}
h1{font-size:1.5rem}h2{font-size:1.1rem;margin-top:2rem}table{border-collapse:collapse}
td,th{padding:.25rem .8rem;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}td.n{text-align:right}
img{max-width:100%}.verdict{font-size:1.15rem;background:#f2f5f8;padding:1rem;border-left:4px solid #1f618d}"""


HEADINGS = {
    Verdict.AGREES: "Measurement and model agree",
    Verdict.NAMED: "What the model lacks has a name",
    Verdict.AMBIGUOUS: "More than one explanation fits",
    Verdict.UNKNOWN: "Something that the catalogue does not hold",
}


def _table(head: list[str], rows: list[list[str]]) -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{top}</tr>{body}</table>"


def _apart(alternatives: Sequence[Sequence[str]]) -> str:
    """The explanations that stand beside each other; one alone is told apart from all others."""
    if len(alternatives) < 2:
        return "<p>Nothing: no other explanation of the catalogue comes near.</p>"
    return _list([" + ".join(names) for names in alternatives])


def _list(items: list[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>" if items else "<p>Nothing.</p>"


def _interval(e: Estimate) -> list[str]:
    """Value and 95 % interval, to a tenth of the standard uncertainty."""
    if e.u is None:
        return [f"{e.value:.5g} {e.unit}", "at a bound"]
    places = max(0, 1 - math.floor(math.log10(e.u))) if e.u > 0.0 else 6
    low, high = e.value - COVERAGE_FACTOR * e.u, e.value + COVERAGE_FACTOR * e.u
    return [f"{e.value:.{places}f} {e.unit}", f"{low:.{places}f} to {high:.{places}f} {e.unit}"]


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g} mm"


def _next_words(report: DiagnosisReport) -> str:
    if report.next_run is not None:
        return report.next_run.words
    if report.verdict is Verdict.AMBIGUOUS:
        return (
            "No run that the bed can drive separates what is open; what else would, if anything, stands in the notes."
        )
    return "Nothing is open."


def report_page(diagnosis: Diagnosis) -> str:
    """Write the report as HTML."""
    report = diagnosis.report
    d = report.disagreement
    before, after = (
        by_channel(diagnosis.data, diagnosis.before_mm),
        by_channel(diagnosis.data, diagnosis.after_mm),
    )
    figure = residual_figure(before, after if report.effects else None, diagnosis.data.chain.history)
    image = base64.b64encode(figure).decode()
    parameters = [
        [effect.name, name, *_interval(e)] for effect in report.effects for name, e in effect.parameters.items()
    ]
    numbers = _table(
        ["disagreement (RMS)", "before", "after"],
        [
            ["all runs", _mm(d.before_rms_mm), _mm(d.after_rms_mm)],
            ["runs that the fit did not see", _mm(d.unseen_before_rms_mm), _mm(d.unseen_after_rms_mm)],
            ["noise", _mm(d.noise_rms_mm), ""],
        ],
    )
    near = [
        [
            " + ".join(str(name) for name in runner["effects"]),  # type: ignore[attr-defined]
            f"{runner['chi_square_more_than_best']:.1f}",
            "far" if runner["distance"] is None else f"{runner['distance']:.1f}",
        ]
        for runner in report.runners_up
    ]
    smallest = [
        [name, f"{entry['parameter']}", f"{entry['size']:.3g} {entry['unit']}"]
        for name, entry in report.smallest_seen.items()
    ]
    sections = [
        ("Where they disagree", _list([place.words for place in report.where])),
        ("Residuals", f'<img alt="residuals before and after" src="data:image/png;base64,{image}">'),
        ("How much", numbers),
        ("Parameters, with 95 % intervals", _table(["effect", "parameter", "value", "interval"], parameters)),
        ("What cannot be told apart", _apart(report.alternatives)),
        ("The next run", f"<p>{escape(_next_words(report))}</p>"),
        ("Runners-up", _table(["explanation", "chi-square behind", "distance to the answer"], near)),
        ("What remains", f"<p>{escape(report.remaining)}</p>"),
        ("Set aside", _list(list(report.outliers))),
        ("Smallest size that this data would have shown", _table(["effect", "parameter", "size"], smallest)),
        ("Not shown by this data", _list([f"{e['name']}: {e['reason']}" for e in report.excluded])),
        ("Notes", _list(list(report.notes))),
    ]
    positioning = positioning_html(diagnosis.positioning)
    if positioning is not None:
        sections.insert(4, ("Positioning accuracy and repeatability (ISO 230-2)", positioning))
    body = "".join(f"<h2>{escape(title)}</h2>{content}" for title, content in sections)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>fingervision: {report.verdict}</title>'
        f"<style>{STYLE}</style><h1>{escape(HEADINGS[report.verdict])}</h1>"
        f'<p class="verdict">{escape(report.sentence)}</p>{body}</html>\n'
    )

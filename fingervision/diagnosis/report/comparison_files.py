"""Write the files of a comparison: one HTML page, one table and one plot for all compared models."""

import json
from collections.abc import Mapping
from html import escape
from pathlib import Path

from matplotlib.figure import Figure

from fingervision.diagnosis.compare import Comparison
from fingervision.diagnosis.report.figure_files import residual_figure, write_figures
from fingervision.diagnosis.report.frame_strip import strip_html
from fingervision.diagnosis.report.html_parts import (
    HINT,
    GapCurves,
    bullets,
    charts_html,
    charts_of,
    gap_curves,
    number,
    page,
    provenance_html,
    table,
)
from fingervision.diagnosis.report.vector_figure import png_bytes
from fingervision.storage.provenance import Provenance

PAGE, COMPARISON, PICTURE = "compare.html", "compare.json", "compare.png"


def comparison_document(found: Mapping[str, Comparison], made: Provenance) -> dict[str, object]:
    """Compose compare.json: the result of the first model at the top level, the results of all models in `models`.

    Parameters
    ----------
    found : mapping of str to Comparison
        Comparison for each model, by its name, in the order in which they were given.
    made : Provenance
        Files, command and versions.
    """
    first = next(iter(found.values())).document()
    models = [{"model": name, **comparison.document()} for name, comparison in found.items()]
    return {**first, "models": models, "provenance": made.document()}


def write_comparison(
    out: Path, found: Mapping[str, Comparison], made: Provenance, measured: Path, title: str = ""
) -> dict[str, object]:
    """Write HTML page, plots and compare.json into an existing folder, and return the content of compare.json.

    The recording from which the table `measured` was made is searched for in the folder of the table; `title` heads the
    page and the plots.
    """
    document = comparison_document(found, made)
    (out / COMPARISON).write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    curves, residuals = curves_of(found), residuals_of(found)
    (out / PICTURE).write_bytes(png_bytes(residuals))
    write_figures(out, curves, residuals, title, left_out=left_out_of(found), prefix="compare_")
    (out / PAGE).write_text(_page(found, curves, made, strip_html(measured), title), encoding="utf-8")
    return document


def curves_of(found: Mapping[str, Comparison]) -> GapCurves:
    """Measured gap, and the gap that each model predicts."""
    first = next(iter(found.values()))
    predictions = {name: one.data.chain.stacked({}) for name, one in found.items()}
    return gap_curves(first.data, first.noise_mm, predictions)


def residuals_of(found: Mapping[str, Comparison]) -> Figure:
    """Plot the residuals: of a single model by channel; of several models, the gap's residual of each."""
    first = next(iter(found.values()))
    if len(found) == 1:
        return residual_figure(first.residual_mm, None, first.data.chain.history, first.left_out)
    residuals = {name: one.residual_mm["gap"] for name, one in found.items()}
    return residual_figure(residuals, None, first.data.chain.history, left_out_of(found))


def left_out_of(found: Mapping[str, Comparison]) -> tuple[int, ...]:
    """Rows left out for every model, because a row left out for one model may be a disagreement with another model."""
    return tuple(sorted(set.intersection(*(set(one.left_out) for one in found.values()))))


def _page(found: Mapping[str, Comparison], curves: GapCurves, made: Provenance, frames: str, title: str) -> str:
    residuals = {"gap": {name: one.residual_mm["gap"] for name, one in found.items()}}
    charts = charts_of(curves, residuals, left_out_of(found))
    rows = [
        [escape(name), number(one.rms_mm), number(one.noise_mm), f"{len(one.places)}"] for name, one in found.items()
    ]
    least = min(found, key=lambda name: found[name].rms_mm)
    verdict = f"{least}: {found[least].words()}."
    if len(found) > 1:
        verdict = f"Nearest of {len(found)} models is {verdict}"
    places = "".join(
        f"<h3>{escape(name)}</h3>{bullets([place.words for place in one.places])}" for name, one in found.items()
    )
    first = next(iter(found.values()))
    sections = [
        ("Gap against input", f'{charts_html(charts, "gap-")}<p class="hint">{HINT}</p>'),
        ("Difference", charts_html(charts, "residual-")),
        ("How much", table(["model", "disagreement, RMS", "random noise, at most", "places beyond the noise"], rows)),
        ("At the turning points", frames),
        ("Where they disagree", places),
        ("Notes", bullets([*first.data.notes, *first.data.refitted()])),
        ("Where this comes from", provenance_html(made)),
    ]  # fmt: skip
    return page("fingervision: comparison", title or "Measurement beside model", verdict, sections, charts)

"""Write the files of a diagnosis: the HTML page, the report, its plots, the corrected model, the next run."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from fingervision.diagnosis.diagnose import Diagnosis
from fingervision.diagnosis.report.figure_files import residual_figure, write_figures
from fingervision.diagnosis.report.frame_strip import strip_html
from fingervision.diagnosis.report.positioning_of_data import positioning_section
from fingervision.diagnosis.report.report_page import SIMULATION, curves_of, report_page
from fingervision.diagnosis.report.residual_localization import by_channel
from fingervision.diagnosis.report.sentences import COVERAGE_FACTOR
from fingervision.domain.effect import curve_values, effect_key
from fingervision.domain.parameter import Estimate
from fingervision.models.corrected import CorrectedModel
from fingervision.models.function_model import FunctionModel
from fingervision.storage.beside import measurement_beside
from fingervision.storage.model_toml import FOLLOWED, write_model
from fingervision.storage.provenance import Provenance
from fingervision.storage.recipe_toml import write_recipe
from fingervision.storage.summary_json import report_document, write_report

# Sentences on the clocks and the gap's uncertainty, from the summary of a measured table.


def measurement_words(table: Path) -> list[str]:
    """Sentences on clocks and uncertainty of a measured table; none if its folder has no summary of a measurement."""
    summary = measurement_beside(table)
    try:
        return [*_clock(summary["settings"]), *_uncertainty(summary)] if summary else []
    except (LookupError, TypeError, ValueError, AttributeError):
        # A summary of another version, or one that was edited, may lack these entries.
        return []


def _clock(settings: Mapping[str, Any]) -> list[str]:
    """State the offset between the clocks, with its expanded uncertainty."""
    if settings.get("drive_offset") == "given":
        return [f"Clock offset: {settings['drive_offset_s']:.4f} s, as given; it was added to the drive's times."]
    if settings.get("drive_offset") != "found":
        return []
    first, over = (COVERAGE_FACTOR * float(settings[key]) for key in ("u_drive_offset_s", "u_drive_time_s"))
    return [
        f"Clock offset, found from the motion and added to the drive's times: {settings['drive_offset_s']:.4f} s, "
        f"U = {first:.2g} s at the drive's first row, U = {over:.2g} s over the frames (k = 2)."
    ]


def _uncertainty(summary: Mapping[str, Any]) -> list[str]:
    """State the gap's uncertainty: its random part, the systematic parts that are known, and what is not included."""
    gap, budget = summary["gap"], summary["uncertainty"]
    words = f"Standard uncertainty of a gap reading (median): {gap['median_u_random_mm']:.2g} mm random"
    whole = gap["median_u_gap_mm"]
    words += (
        "; the uncertainty of the scale is not known" if whole is None else f", {whole:.2g} mm with the calibration"
    )
    shared = [f"{part['source']} {part['rms_u_mm']:.2g} mm" for part in budget["parts"] if part["kind"] == "shared"]
    words += f". Equal in every reading: {'; '.join(shared)}" if shared else ""
    lacks = [str(item) for item in budget["not_included"]]
    return [f"{words}.", *([f"Not included: {'; '.join(lacks)}."] if lacks else [])]


PAGE, REPORT, MODEL, NEXT_RUN = "report.html", "report.json", "model.toml", "next_run.toml"


def write_answer(
    out: Path,
    done: Diagnosis,
    model: CorrectedModel,
    made: Provenance,
    table: Path,
    title: str = "",
    name: str = SIMULATION,
) -> dict[str, object]:
    """Write the files of a diagnosis into a folder, replacing earlier ones, and return the content of report.json.

    Parameters
    ----------
    out : Path
        An existing folder.
    done : Diagnosis
        Result of the diagnosis.
    model : CorrectedModel
        Model that was diagnosed, with the effects that it already includes.
    made : Provenance
        Files, command and versions from which the result was obtained.
    table : Path
        Path of the measured table, next to which its recording is searched.
    title : str
        Title of the plots.
    name : str
        Name of the model in the legends.
    """
    report = done.report
    names = model.base.names if isinstance(model.base, FunctionModel) else None
    if done.data.table.followed:
        names = {FOLLOWED: done.data.table.followed}
    write_model(out / MODEL, Path(model.base_path), corrected(done, model).effects, model.kind, names)
    if report.next_run is None:
        (out / NEXT_RUN).unlink(missing_ok=True)
    else:
        write_recipe(out / NEXT_RUN, report.next_run.name, report.next_run.steps)
    document = report_document(report, MODEL, NEXT_RUN if report.next_run else None)
    document["iso230"] = positioning_section(done.positioning)
    document["provenance"] = made.document()
    write_report(out / REPORT, document)
    before, after = (by_channel(done.data, mm) for mm in (done.before_mm, done.after_mm))
    residuals = residual_figure(before, after if report.effects else None, done.data.chain.history, done.left_out)
    write_figures(out, curves_of(done, name), residuals, title, left_out=done.left_out)
    (out / PAGE).write_text(report_page(done, made, strip_html(table), measurement_words(table)), encoding="utf-8")
    return document


def corrected(done: Diagnosis, model: CorrectedModel) -> CorrectedModel:
    """Add the named effects to the model that was diagnosed."""
    effects: dict[str, Mapping[str, Estimate]] = dict(model.effects)
    for effect in done.report.effects:
        curve = curve_values([at for at, _ in effect.points], [error for _, error in effect.points])
        key = effect_key(effect.name, effect.place, effect.end)
        effects[key] = {**effect.parameters, **{name: Estimate(value, None) for name, value in curve.items()}}
    return replace(model, effects=effects)

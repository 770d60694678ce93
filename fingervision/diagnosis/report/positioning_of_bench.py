"""The positioning figures of a diagnosis: what report.json and report.html tell beside the answer."""

from html import escape

import numpy as np

from fingervision.diagnosis.diagnose import Diagnosis
from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.input.repeated_targets import NoRepeatedTargets
from fingervision.diagnosis.report.positioning_of_table import positioning_of_table
from fingervision.diagnosis.report.positioning_report import PositioningReport
from fingervision.diagnosis.report.positioning_words import (
    STANDARD,
    positioning_document,
    positioning_notes,
    positioning_rows,
    positioning_words,
)
from fingervision.domain.effect import Array


def positioning_of_diagnosis(done: Diagnosis) -> PositioningReport | NoRepeatedTargets:
    """Positioning figures of a diagnosed table, or why it has none.

    Parameters
    ----------
    done : Diagnosis
        The answer with measurement and model.
    """
    chain = done.bench.chain
    history = chain.history
    rows = history.input_mm.size

    def predict_mm(acting: Settings) -> Array:
        return np.asarray(chain.stacked(acting)[:rows], dtype=np.float64)

    answer = {
        effect.name: {name: estimate.value for name, estimate in effect.parameters.items()}
        for effect in done.report.effects
    }
    measured = np.ones(rows, dtype=bool)
    gap_mm = done.bench.stacked_mm[:rows]
    return positioning_of_table(history.input_mm, measured, history.runs, history.time_s, gap_mm, predict_mm, answer)


def positioning_section(found: PositioningReport | NoRepeatedTargets) -> dict[str, object]:
    """Section `iso230` of report.json; `figures` is null, with the reason, where the table has no repeated targets."""
    if isinstance(found, NoRepeatedTargets):
        return {"standard": STANDARD, "figures": None, "reason": found.reason}
    return positioning_document(found)


def positioning_html(found: PositioningReport | NoRepeatedTargets) -> str | None:
    """Section of report.html: sentences, table, notes; None where the table has no repeated targets."""
    if isinstance(found, NoRepeatedTargets):
        return None
    head, rows = positioning_rows(found)
    lines = ["<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>"]
    lines += ["<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows]
    told = "".join(f"<li>{escape(sentence)}</li>" for sentence in positioning_words(found))
    notes = "".join(f"<p>{escape(note)}</p>" for note in positioning_notes(found))
    return f"<ul>{told}</ul><table>{''.join(lines)}</table>{notes}"

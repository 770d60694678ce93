"""Positioning accuracy of a measured table compared with its model, as given in report.json and report.html."""

from html import escape

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.repeated_targets import NoRepeatedTargets
from fingervision.diagnosis.report.html_parts import table
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


def positioning_of_data(data: Observations, answer: Settings) -> PositioningReport | NoRepeatedTargets:
    """Positioning accuracy for a measured table, its model and a diagnosis, or the reason why there is none.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    answer : Settings
        Everything that the search found: effects with parameters and start states, and the curve of a map.
    """
    table, rows = data.table, data.table.input_mm.size

    def predict_mm(acting: Settings) -> Array:
        return np.asarray(data.chain.stacked(acting)[:rows], dtype=np.float64)

    if table.path is None:
        path = (table.input_mm, np.ones(rows, dtype=bool), table.runs, table.time_s)
    else:
        measured = np.zeros(table.path.input_mm.size, dtype=bool)
        measured[table.path.rows] = True
        path = (table.path.input_mm, measured, table.path.runs, table.path.time_s)
    if table.time_s is None:
        return NoRepeatedTargets("the table has no time_s, and without times the order of the rows is unknown")
    return positioning_of_table(*path, table.gap_mm, predict_mm, answer)


def positioning_section(found: PositioningReport | NoRepeatedTargets) -> dict[str, object]:
    """Section `iso230` of report.json; `figures` is null, with the reason, if no targets are repeated."""
    if isinstance(found, NoRepeatedTargets):
        return {"standard": STANDARD, "figures": None, "reason": found.reason}
    return positioning_document(found)


def positioning_html(found: PositioningReport | NoRepeatedTargets) -> str | None:
    """Section of report.html with sentences, table and notes; None if no targets are repeated."""
    if isinstance(found, NoRepeatedTargets):
        return None
    head, rows = positioning_rows(found)
    told = "".join(f"<li>{escape(sentence)}</li>" for sentence in positioning_words(found))
    notes = "".join(f"<p>{escape(note)}</p>" for note in positioning_notes(found))
    return f"<ul>{told}</ul>{table(head, rows)}{notes}"

"""Note on a measured table whose camera response was assumed, according to the summary of its measurement."""

import csv
import statistics
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from fingervision.storage.plain_file import json_of
from fingervision.storage.summary_json import GAPS, SUMMARY


def response_note(summary: Mapping[str, Any], shifts_px: Iterable[float]) -> tuple[str, ...]:
    """Sentence that the camera's response was assumed, and by how much this assumption may shift the gap.

    An error of the response moves both edges equally in every frame, so that it has the signature of an offset.

    Parameters
    ----------
    summary : mapping
        Content of summary.json.
    shifts_px : iterable of float
        Values of the column u_shift_px of gaps.csv.

    Returns
    -------
    tuple of str
        One sentence if the summary says that the response is not known; none otherwise.
    """
    try:
        settings, px_per_mm = summary["settings"], float(summary["scale"]["px_per_mm"])
        is_known, response = settings.get("response_known", True), settings["response"]
    except (LookupError, TypeError, ValueError, AttributeError):
        return ()
    if is_known is not False or not px_per_mm > 0.0:
        return ()
    found = list(shifts_px)
    size = ""
    if found and statistics.median(found) > 0.0:
        size = f" by up to {1e3 * statistics.median(found) / px_per_mm:.2g} um (u_shift_px, median)"
    return (
        f"the camera's response is not known and was taken as {response}: another usual response may change all gaps "
        f"equally{size}, like an offset; measure the response with `fingervision calibrate response`.",
    )


def response_note_beside(table: Path) -> tuple[str, ...]:
    """Sentence that the response was assumed, for a gaps.csv with its summary.json; None for other tables."""
    if table.name != GAPS:
        return ()
    try:
        summary = json_of(table.parent / SUMMARY)
        with table.open(encoding="utf-8", newline="") as file:
            cells = [row.get("u_shift_px") for row in csv.DictReader(line for line in file if not line.startswith("#"))]
        return response_note(summary, [float(cell) for cell in cells if cell])
    except (OSError, ValueError):
        return ()

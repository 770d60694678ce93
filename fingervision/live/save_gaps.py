"""Saving of the gaps that the browser page shows."""

from pathlib import Path

from fingervision.live.view import View
from fingervision.storage.gaps_csv import GapsCsv
from fingervision.storage.out_folder import make_out_folder

DRIVE_COLUMNS = ("run", "input_mm", "force_n")
SAVED_GAPS = "live_gaps.csv"


def save_gaps(view: View) -> Path:
    """Save the gaps in memory in the format of gaps.csv; for a recording, save the table that `measure` wrote.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    if view.table is not None:
        return view.table
    make_out_folder(view.out)
    path = view.out / SAVED_GAPS
    rows = list(view.rows(view.oldest_row, view.row_count))
    is_driven = any(row.input_mm is not None for row in rows)
    with GapsCsv(path, DRIVE_COLUMNS if is_driven else ()) as table:
        table.add(rows)
    return path

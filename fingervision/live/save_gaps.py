"""The gaps that the page shows, as a table."""

from pathlib import Path

from fingervision.live.view import View
from fingervision.storage.gaps_csv import GapsCsv
from fingervision.storage.out_folder import make_out_folder

SAVED_GAPS = "live_gaps.csv"


def save_gaps(view: View) -> Path:
    """Write the gaps that are kept as gaps.csv has them; of a recording, the table as `measure` wrote it.

    Raises
    ------
    FingervisionError
        The file cannot be written.
    """
    if view.table is not None:
        return view.table
    make_out_folder(view.out)
    path = view.out / SAVED_GAPS
    with GapsCsv(path) as table:
        table.add(list(view.rows(view.oldest_row, view.row_count)))
    return path

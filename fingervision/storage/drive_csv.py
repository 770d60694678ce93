"""The file drive.csv: the recorded input over time, `time_s,input_mm[,run][,force_n]`."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import read_columns

COLUMNS = ("time_s", "input_mm", "force_n")


def read_drive(path: Path) -> DriveHistory:
    """Read a drive table.

    Lines that start with `#` are comments; the columns may be in any order, and other columns are ignored.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, a column is missing, a cell is not a number, times do not increase, or the rows of a
        run are not contiguous.
    """
    table = read_columns(path, COLUMNS[:2], COLUMNS[2:], texts=("run",))
    if not table.lines:
        raise DataError(f"{path} must have at least one row below its header, but has none.")
    values = {name: table.numbers(name, complete=True).value for name in COLUMNS if name in table}
    runs = table.texts("run")
    return drive_rows(path, values, None if runs is None else tuple(runs), table.lines)


def drive_rows(
    path: Path, values: Mapping[str, NDArray[np.float64]], runs: tuple[str, ...] | None, lines: Sequence[int]
) -> DriveHistory:
    """Select the columns of a drive table, and check that times increase and rows of a run are contiguous.

    Parameters
    ----------
    path : Path
        File of the columns, for error messages.
    values : mapping of str to ndarray of float, shape (n,)
        Columns `time_s`, `input_mm` and, if recorded, `force_n`.
    runs : tuple of str, length n, or None
        Name of the run of each row.
    lines : sequence of int, length n
        Line number in the file of each row.

    Raises
    ------
    DataError
        Times do not increase, or the rows of a run are not contiguous.
    """
    times = values["time_s"]
    back = np.flatnonzero(~(np.diff(times) > 0.0))
    if back.size:
        at = int(back[0]) + 1
        raise DataError(
            f"time_s must increase from row to row, but in line {lines[at]} of {path} it is {times[at]:g} "
            f"after {times[at - 1]:g}: state the times of all runs on the recording's clock, in rising order."
        )
    seen: set[str] = set()
    for at in range(1, len(runs) if runs is not None else 0):
        if runs is not None and runs[at] != runs[at - 1]:
            seen.add(runs[at - 1])
            if runs[at] in seen:
                raise DataError(
                    f"The rows of one run must follow each other, but run {runs[at]} starts again in line "
                    f"{lines[at]} of "
                    f"{path}."
                )
    return DriveHistory(times, values["input_mm"], runs, values.get("force_n"))

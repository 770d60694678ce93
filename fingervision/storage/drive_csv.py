"""The file drive.csv: the recorded input over time, `time_s,input_mm[,run][,force_n]`."""

import csv
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError, FingervisionError, InputFileError
from fingervision.storage.csv_columns import read_block
from fingervision.storage.decimal_number import are_decimal, decimal_number
from fingervision.storage.plain_file import NotUtf8Error, text_of

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
    block = None
    with suppress(FingervisionError):  # a file that cannot be read is reported below
        block = read_block(path)
    if block is not None and {"time_s", "input_mm"} <= block.keys() and "run" not in block:
        kept = {name: block[name] for name in COLUMNS if name in block}
        return drive_rows(path, kept, None, range(2, 2 + block["time_s"].size))
    lines = _lines(path)
    if not lines:
        raise DataError(f"{path} must have a header line time_s,input_mm[,run][,force_n], but is empty.")
    header = [cell.strip() for cell in lines[0][1]]
    for name in ("time_s", "input_mm"):
        if header.count(name) != 1:
            raise DataError(f"{path} must have one column {name}, but its header is {','.join(header)}.")
    if len(lines) == 1:
        raise DataError(f"{path} must have at least one row below its header, but has none.")
    for line, cells in lines[1:]:
        if len(cells) != len(header):
            raise DataError(f"Line {line} of {path} must have {len(header)} cells, but has {len(cells)}.")
    numbers = [line for line, _ in lines[1:]]
    columns = list(zip(*(cells for _, cells in lines[1:]), strict=True))
    values = {name: _numbers(path, numbers, name, columns[header.index(name)]) for name in COLUMNS if name in header}
    runs = tuple(run.strip() for run in columns[header.index("run")]) if "run" in header else None
    return drive_rows(path, values, runs, numbers)


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


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Iterate over rows with their line numbers, without comments and empty lines."""
    if path.exists() and not path.is_file():
        raise DataError(f"{path} must be a table in a file, but is a folder or a pipe: save it as a file first.")
    try:
        text = text_of(path)
    except FileNotFoundError:
        raise InputFileError(f"There is no drive table {path}.") from None
    except OSError as error:
        raise InputFileError(f"The drive table {path} could not be read ({error.strerror}).") from error
    except NotUtf8Error as error:
        raise DataError(f"{path} must be a CSV table in UTF-8, but is not: {error}.") from error
    kept = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line and not line.startswith("#") and line.strip()
    ]
    if '"' not in text:
        return [(number, line.split(",")) for number, line in kept]
    rows = []
    for number, line in kept:
        try:
            rows.append((number, next(csv.reader([line], strict=True))))
        except csv.Error as error:
            raise DataError(
                f"Line {number} of {path} has a quote that cannot be read ({error}): close or remove it."
            ) from error
    return rows


def _numbers(path: Path, lines: Sequence[int], name: str, cells: Sequence[str]) -> NDArray[np.float64]:
    try:
        read = float if are_decimal(cells) else decimal_number
        value = np.array(list(map(read, cells)), dtype=np.float64)
    except ValueError:
        value = np.array([np.nan])
    if not np.all(np.isfinite(value)):
        value = np.array([_number(path, line, name, cell) for line, cell in zip(lines, cells, strict=True)])
    return value


def _number(path: Path, line: int, name: str, cell: str) -> float:
    try:
        value = decimal_number(cell)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise DataError(f"{name} in line {line} of {path} must be a number, but is '{cell.strip()}'.")
    return value

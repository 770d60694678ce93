"""Times of images from a table in their folder."""

import csv
from math import isfinite
from pathlib import Path

from fingervision.domain.errors import DataError

TIMES_FILE = "times.csv"


def times_of(files: tuple[Path, ...]) -> tuple[float, ...] | None:
    """Read the times of images from times.csv in their folder.

    The table has the columns `file,time_s`, or only `time_s` with one row per image, in order.

    Returns
    -------
    tuple of float or None
        Time of each image in seconds; None if there is no table.

    Raises
    ------
    DataError
        If the table cannot be read, has an invalid row, or does not fit the images.
    """
    table = files[0].parent / TIMES_FILE
    if not table.is_file():
        return None
    rows = _rows(table)
    if not rows:
        raise DataError(f"{table} must have a header line with time_s, but is empty.")
    header = [cell.strip() for cell in rows[0][1]]
    if "time_s" not in header:
        raise DataError(f"{table} must have a column time_s, but has {', '.join(header)}.")
    at, named = header.index("time_s"), header.index("file") if "file" in header else None
    times = {}
    for place, (line, cells) in enumerate(rows[1:]):
        if len(cells) != len(header):
            raise DataError(f"Line {line} of {table} must have {len(header)} cells, but has {len(cells)}.")
        times[cells[named].strip() if named is not None else place] = _seconds(table, line, cells[at])
    if named is None:
        if len(times) != len(files):
            raise DataError(
                f"{table} must have a time for each of the {len(files)} images, but has {len(times)}: "
                "add a column `file` with the names of the images."
            )
        return tuple(times.values())
    for file in files:
        if file.name not in times:
            raise DataError(f"{table} must have a time for each image, but has none for {file.name}.")
    return tuple(times[file.name] for file in files)


def _rows(table: Path) -> list[tuple[int, list[str]]]:
    """Rows of the table with their line numbers; comments and empty lines are omitted."""
    try:
        lines = table.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{table} could not be read as a table of times: {error}.") from error
    return [
        (number, next(csv.reader([line])))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    ]


def _seconds(table: Path, line: int, cell: str) -> float:
    try:
        time_s = float(cell)
    except ValueError:
        time_s = float("nan")
    if not isfinite(time_s):
        raise DataError(f"time_s in line {line} of {table} must be a number of seconds, but is '{cell}'.")
    return time_s

"""Gaps of a gaps.csv as repeated readings of parts, for a gauge repeatability and reproducibility study."""

import csv
from math import isfinite
from pathlib import Path

from fingervision.domain.errors import DataError, unreadable
from fingervision.storage.decimal_number import decimal_number
from fingervision.storage.plain_file import plain, why

# Inputs that differ by less (mm) count as one part, because stages do not return to a position more exactly.
SAME_INPUT_PLACES = 3


def read_gap_readings(path: Path, by_input: bool) -> dict[float | None, list[float]]:
    """Read the gaps of all video frames that have a gap.

    Parameters
    ----------
    path : Path
        A gaps.csv.
    by_input : bool
        Whether each different input of the drive counts as a separate part; otherwise the recording shows a single
        part, named None.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read or holds no gaps.
    """
    readings: dict[float | None, list[float]] = {}
    try:
        lines = [line for line in plain(path).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise unreadable(error)(
            f"The table {path} could not be read: {why(error)}; give a gaps.csv written by fingervision."
        ) from error
    table = csv.DictReader(lines)
    needed = {"gap_mm"} | ({"input_mm"} if by_input else set())
    missing = needed - set(table.fieldnames or ())
    if missing:
        raise DataError(
            f"The table {path} must have a column {min(missing)}, but has none: give a gaps.csv written by "
            "fingervision."
        )
    for number, row in enumerate(table, start=2):
        if not row["gap_mm"] or (by_input and not row["input_mm"]):
            continue
        try:
            gap_mm = decimal_number(row["gap_mm"])
            part = round(decimal_number(row["input_mm"]), SAME_INPUT_PLACES) if by_input else None
        except ValueError:
            gap_mm, part = float("nan"), None
        if not isfinite(gap_mm):
            raise DataError(f"Row {number} of {path} must hold a number as gap_mm, but holds {row['gap_mm']!r}.")
        readings.setdefault(part, []).append(gap_mm)
    if not readings:
        raise DataError(f"The table {path} must hold at least one gap, but holds none.")
    return readings

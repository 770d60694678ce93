"""Columns of a CSV table with units in their names: comma, point, `#` comments, an empty cell is no value."""

import csv
import difflib
from math import isfinite
from pathlib import Path

from fingervision.domain.errors import FingervisionError


def read_columns(path: Path, required: tuple[str, ...], known: tuple[str, ...]) -> dict[str, list[str]]:
    """Read the known columns as text, by name; others are not looked at.

    Raises
    ------
    FingervisionError
        The file cannot be read, is no table, or a required column is missing: with the nearest name found.
    """
    rows = [
        (number, cells)
        for number, cells in enumerate(_cells(path), start=1)
        if any(cell.strip() for cell in cells) and not cells[0].lstrip().startswith("#")
    ]
    if not rows:
        raise FingervisionError(f"{path} must have a header line with {','.join(required)}, but is empty.")
    header = [cell.strip() for cell in rows[0][1]]
    for name in required:
        if name not in header:
            near = difflib.get_close_matches(name, [h for h in header if h not in (*required, *known)], n=1, cutoff=0.5)
            hint = f"rename {near[0]}, in the unit of the name" if near else "add it"
            raise FingervisionError(f"{path} must have a column {name}, but has {','.join(header)}: {hint}.")
    for name in (*required, *known):
        if header.count(name) > 1:
            raise FingervisionError(f"{path} must have each column once, but {name} stands twice: remove one.")
    for number, cells in rows[1:]:
        if len(cells) != len(header):
            raise FingervisionError(
                f"Line {number} of {path} must have {len(header)} cells like the header, but has {len(cells)}: mend it."
            )
    return {
        name: [cells[header.index(name)].strip() for _, cells in rows[1:]]
        for name in (*required, *known)
        if name in header
    }


def _cells(path: Path) -> list[list[str]]:
    if path.exists() and not path.is_file():
        raise FingervisionError(
            f"{path} must be a table in a file, but is a folder or a pipe: save it as a file first."
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise FingervisionError(f"There is no table {path}.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise FingervisionError(f"{path} must be a CSV table in UTF-8, but could not be read: {error}.") from error
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        return list(reader)
    except csv.Error as error:
        raise FingervisionError(
            f"{path} must be a CSV table, but its quotes cannot be read, by line {reader.line_num} ({error}): close or "
            "remove the quote."
        ) from error


def number(path: Path, name: str, row: int, cell: str) -> float | None:
    """Read a cell as a finite number, or None where it is empty."""
    if not cell:
        return None
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise FingervisionError(
            f"{name} must be a finite number, but is {cell} in data row {row + 1} of {path}: leave it empty."
        )
    return value

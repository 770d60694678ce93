"""Read columns of a CSV table in fingervision's own format (commas, decimal points, `#` comments, units in names)."""

import csv
import difflib
from collections.abc import Iterator
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, InputFileError, unreadable
from fingervision.storage.decimal_number import decimal_number
from fingervision.storage.number_block import number_block
from fingervision.storage.plain_file import NotUtf8Error, text_of, why

CHUNK_LINES = 1000
"""Number of lines that are split at a time, so that the cells fit into the cache; splitting all lines at once would
need ten times the file's size in memory."""


def read_columns(path: Path, required: tuple[str, ...], known: tuple[str, ...]) -> dict[str, list[str]]:
    """Read the cells of known columns as text, by column name; other columns are ignored.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, is not a table, or lacks a required column; the message names the most similar column.
    """
    text = _text(path)
    lines = _reader(path, text)
    header = next(lines, None)
    if header is None:
        raise DataError(f"{path} must have a header line with {','.join(required)}, but is empty.")
    names = [cell.strip() for cell in header[1]]
    for name in required:
        if name not in names:
            near = difflib.get_close_matches(name, [h for h in names if h not in (*required, *known)], n=1, cutoff=0.5)
            hint = f"rename {near[0]}, in the unit of the name" if near else "add it"
            raise DataError(f"{path} must have a column {name}, but has {','.join(names)}: {hint}.")
    wanted = [name for name in (*required, *known) if name in names]
    for name in wanted:
        if names.count(name) > 1:
            raise DataError(f"{path} must have each column only once, but {name} occurs twice: remove one of them.")
    plain = _without_quotes(text, names, wanted)
    if plain is not None:
        return plain
    found: dict[str, list[str]] = {name: [] for name in wanted}
    adders = [(names.index(name), cells.append) for name, cells in found.items()]
    wide = len(names)
    for number, cells in lines:
        if len(cells) != wide:
            raise DataError(
                f"Line {number} of {path} must have {wide} cells like the header, but has {len(cells)}: correct it."
            )
        for place, add in adders:
            add(cells[place].strip())
    return found


def header_of(path: Path) -> list[str]:
    """Read the names of a table's columns.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read.
    """
    header = next(_reader(path, _text(path)), None)
    return [] if header is None else [cell.strip() for cell in header[1]]


def _without_quotes(text: str, names: list[str], wanted: list[str]) -> dict[str, list[str]] | None:
    """Read columns of a table without quotes by a faster method; None if a row needs the general reader."""
    if '"' in text:
        return None
    lines = text.splitlines()
    first = next(k for k, line in enumerate(lines) if not line.lstrip().startswith("#") and line.strip(", \t"))
    wide = len(names)
    places = [names.index(name) for name in wanted]
    found: dict[str, list[str]] = {name: [] for name in wanted}
    for begin in range(first + 1, len(lines), CHUNK_LINES):
        chunk = lines[begin : begin + CHUNK_LINES]
        rows = [line.split(",") for line in chunk if line.strip(", \t") and not line.lstrip().startswith("#")]
        if any(len(row) != wide for row in rows):
            return None
        for place, cells in zip(places, found.values(), strict=True):
            cells.extend([row[place].strip() for row in rows])
    return found


def _reader(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Iterate over rows with their row numbers, without comments and empty rows."""
    for number, cells in enumerate(_cells(path, text), start=1):
        if cells and not cells[0].lstrip().startswith("#") and any(map(str.strip, cells)):
            yield number, cells


def read_block(path: Path) -> dict[str, NDArray[np.float64]] | None:
    """Read a large table that contains only numbers, by column name; None if it contains anything else.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read.
    """
    lines = _text(path).splitlines()
    names = [cell.strip() for cell in lines[0].split(",")] if lines else []
    if len(set(names)) < len(names) or '"' in "".join(names):
        return None
    block = number_block(lines[1:], ",", len(names))
    return None if block is None else dict(zip(names, block.T.copy(), strict=True))


def _text(path: Path) -> str:
    if path.exists() and not path.is_file():
        raise DataError(f"{path} must be a table in a file, but is a folder or a pipe: save it as a file first.")
    try:
        return text_of(path)
    except FileNotFoundError:
        raise InputFileError(f"There is no table {path}.") from None
    except (OSError, NotUtf8Error) as error:
        raise unreadable(error)(f"{path} must be a CSV table in UTF-8, but could not be read: {why(error)}.") from error


def _cells(path: Path, text: str) -> Iterator[list[str]]:
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        yield from reader
    except csv.Error as error:
        raise DataError(
            f"{path} must be a CSV table, but a quote at or before line {reader.line_num} cannot be read "
            f"({error}): close or remove it."
        ) from error


def number(path: Path, name: str, row: int, cell: str) -> float | None:
    """Read a cell as a finite number; None if the cell is empty."""
    if not cell:
        return None
    try:
        value = decimal_number(cell)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise DataError(
            f"{name} must be a finite number, but is {cell} in data row {row + 1} of {path}: correct it, or "
            "leave the cell empty."
        )
    return value

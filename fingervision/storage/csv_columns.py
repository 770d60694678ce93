"""Columns of numbers in a table, and of CSV tables in fingervision's own format; empty cells have a mask."""

import csv
import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, InputFileError, unreadable
from fingervision.storage.plain_file import NotUtf8Error, text_of, why

# Columns of numbers in a table, with a mask of empty cells, and the notation of numbers in own files.

FEWEST_LINES = 2000
"""Smallest number of lines for the fast method; reading fewer lines cell by cell takes less than 20 ms."""


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """One column of numbers.

    Parameters
    ----------
    value : ndarray of float, shape (n,)
        Finite numbers; 0 for an empty cell.
    present : ndarray of bool, shape (n,)
        Whether the cell holds a number.
    """

    value: NDArray[np.float64]
    present: NDArray[np.bool_]

    @classmethod
    def whole(cls, value: NDArray[np.float64]) -> "Numbers":
        """Make a column from values without empty cells."""
        return cls(value, np.ones(value.size, dtype=np.bool_))

    @property
    def complete(self) -> bool:
        """Whether the column has no empty cell."""
        return bool(self.present.all())


def numbers_in(path: Path, name: str, cells: Sequence[str], lines: Sequence[int] = ()) -> Numbers:
    """Read cells as finite numbers; an empty cell represents a missing value.

    Parameters
    ----------
    path : Path
        File of the cells, for error messages.
    name : str
        Name of the column.
    cells : sequence of str, length n
        The cells.
    lines : sequence of int, length n, optional
        Line of each cell; the number of its row by default.

    Raises
    ------
    DataError
        A cell is not a finite number; the message names the first such cell and its line.
    """
    try:
        read = float if are_decimal(cells) else decimal_number
        value = np.array(list(map(read, cells)), dtype=np.float64)
        present = np.ones(value.size, dtype=np.bool_)
    except ValueError:
        present = np.array([bool(cell) for cell in cells], dtype=np.bool_)
        value = np.array([_number(cell) for cell in cells], dtype=np.float64)
    wrong = np.flatnonzero(~np.isfinite(value))
    if wrong.size:
        at = int(wrong[0])
        where = f"line {lines[at]}" if len(lines) else f"data row {at + 1}"
        raise DataError(
            f"{name} must be a finite number, but is '{cells[at]}' in {where} of {path}: correct it, or leave the cell "
            "empty."
        )
    return Numbers(value, present)


def _number(cell: str) -> float:
    """Number in a cell: 0 if it is empty, and not finite if it holds no number."""
    try:
        return decimal_number(cell) if cell else 0.0
    except ValueError:
        return float("nan")


def decimal_number(cell: str) -> float:
    """Read a decimal number written in ASCII characters.

    Python's own conversion would also accept 1_0 as 10, and digits of other scripts.

    Raises
    ------
    ValueError
        The cell is not a decimal number in a notation that tables use.

    Examples
    --------
    >>> decimal_number(" -1.5e-3 ")
    -0.0015
    >>> decimal_number("1_0")
    Traceback (most recent call last):
    ...
    ValueError: 1_0 is not a decimal number
    """
    if not are_decimal((cell,)):
        raise ValueError(f"{cell} is not a decimal number")
    return float(cell)


def are_decimal(cells: Iterable[str]) -> bool:
    """Whether cells that Python can convert to numbers are also decimal numbers in a notation used in tables."""
    joined = "".join(cells)
    return "_" not in joined and joined.isascii()


def is_number(value: object) -> bool:
    """Whether a value of a document is an integer or floating-point number that a float can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return isfinite(value)
    except OverflowError:
        return False


def number_block(lines: Sequence[str], separator: str | None, wide: int) -> NDArray[np.float64] | None:
    """Read lines of numbers in one call; None if each cell must be read separately.

    Parameters
    ----------
    lines : sequence of str
        Rows of the table, without a header.
    separator : str or None
        Separator between two cells; None for any white space.
    wide : int
        Number of cells in a row.

    Returns
    -------
    ndarray of float, shape (n, wide), or None
        Numbers of the table; None if there are fewer rows than `FEWEST_LINES`, if a cell is empty or not a finite
        number, or if rows differ in length.
    """
    if len(lines) < FEWEST_LINES:
        return None
    try:
        block = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2, dtype=np.float64)
    except ValueError:
        return None
    # If blank lines were skipped, the following rows would get wrong line numbers.
    if block.shape != (len(lines), wide) or not np.all(np.isfinite(block)):
        return None
    return block


HEAD_BYTES = 100_000
"""Part of a file in which the column names are looked for."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnTable:
    """Columns of a table, by name.

    Parameters
    ----------
    path : Path
        The file.
    names : tuple of str
        Names of all columns of the file.
    columns : mapping of str to (sequence of str, or Numbers)
        Cells of the columns that were asked for; as numbers if the table holds nothing else.
    lines : sequence of int
        Line of each row.
    """

    path: Path
    names: tuple[str, ...]
    columns: Mapping[str, Sequence[str] | Numbers]
    lines: Sequence[int]

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def texts(self, name: str) -> Sequence[str] | None:
        """Return the cells of a column of texts; None if the table does not have it."""
        cells = self.columns.get(name)
        return None if isinstance(cells, Numbers) else cells

    def numbers(self, name: str, *, complete: bool = False) -> Numbers:
        """Return a column of numbers.

        Raises
        ------
        DataError
            A cell is not a finite number, or is empty in a column that must be `complete`.
        """
        cells = self.columns[name]
        found = cells if isinstance(cells, Numbers) else numbers_in(self.path, name, cells, self.lines)
        if complete and not found.complete:
            line = self.lines[int(found.present.argmin())]
            raise DataError(
                f"{name} must be a number in every row, but line {line} of {self.path} has none: fill the cell, or "
                "remove the row."
            )
        return found


def read_columns(
    path: Path,
    required: Sequence[str],
    known: Sequence[str] = (),
    texts: Sequence[str] = (),
    others: Callable[[Sequence[str]], Sequence[str]] | None = None,
) -> OwnTable:
    """Read columns of a table.

    Parameters
    ----------
    path : Path
        The table.
    required, known : sequence of str
        Columns that it must have, and that it may have.
    texts : sequence of str
        Columns of texts, which it may have.
    others : callable, optional
        Function that chooses further columns from the names of all.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, is not a table, or lacks a required column; the message names the most similar column.
    """
    text = _text(path)
    lines = _rows(path, text)
    first, header = next(lines, (0, []))
    if not header:
        raise DataError(f"{path} must have a header line with {','.join(required)}, but is empty.")
    names = tuple(cell.strip() for cell in header)
    for name in required:
        if name not in names:
            near = difflib.get_close_matches(name, [h for h in names if h not in (*required, *known)], n=1, cutoff=0.5)
            hint = f"rename {near[0]}, in the unit of the name" if near else "add it"
            raise DataError(f"{path} must have a column {name}, but has {','.join(names)}: {hint}.")
    wanted = [name for name in dict.fromkeys((*required, *known, *texts)) if name in names]
    for name in wanted:
        if names.count(name) > 1:
            raise DataError(f"{path} must have each column only once, but {name} occurs twice: remove one of them.")
    wanted += [] if others is None else others([name for name in names if names.count(name) == 1])
    places = {name: names.index(name) for name in wanted}
    whole = text.splitlines()
    has_texts = '"' in text or any(name in names for name in texts)
    block = None if has_texts else number_block(whole[first:], ",", len(names))
    if block is not None:
        numbers = {name: Numbers.whole(block[:, place].copy()) for name, place in places.items()}
        return OwnTable(path, names, numbers, range(first + 1, len(whole) + 1))
    found: dict[str, list[str]] = {name: [] for name in places}
    adders = [(place, found[name].append) for name, place in places.items()]
    rows = []
    for line, cells in lines:
        if len(cells) != len(names):
            raise DataError(
                f"Line {line} of {path} must have {len(names)} cells like the header, but has {len(cells)}: correct it."
            )
        rows.append(line)
        for place, add in adders:
            add(cells[place].strip())
    return OwnTable(path, names, found, rows)


def header_of(path: Path) -> list[str]:
    """Return the column names in the first line that is no comment; none if the file holds no text in UTF-8."""
    if not path.is_file():  # a pipe would block
        return []
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
        text = head.decode("utf-8-sig", "strict" if len(head) < HEAD_BYTES else "replace")
    except (OSError, UnicodeDecodeError):
        return []
    first = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")
    return [] if "\0" in text else [cell.strip() for cell in next(csv.reader([first]), [])]


def _text(path: Path) -> str:
    if path.exists() and not path.is_file():
        raise DataError(f"{path} must be a table in a file, but is a folder or a pipe: save it as a file first.")
    try:
        return text_of(path)
    except FileNotFoundError:
        raise InputFileError(f"There is no table {path}.") from None
    except (OSError, NotUtf8Error) as error:
        raise unreadable(error)(f"{path} must be a CSV table in UTF-8, but could not be read: {why(error)}.") from error


def _rows(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Iterate over rows with the number of their line, without comments and empty rows."""
    if '"' not in text:
        for line, row in enumerate(text.splitlines(), start=1):
            if row.strip(", \t") and not row.lstrip().startswith("#"):
                yield line, row.split(",")
        return
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    try:
        for cells in reader:
            if cells and not cells[0].lstrip().startswith("#") and any(map(str.strip, cells)):
                yield reader.line_num, cells
    except csv.Error as error:
        raise DataError(
            f"{path} must be a CSV table, but a quote at or before line {reader.line_num} cannot be read "
            f"({error}): close or remove it."
        ) from error

"""Read columns of a CSV table in fingervision's own format (commas, decimal points, `#` comments, units in names)."""

import csv
import difflib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import DataError, InputFileError, unreadable
from fingervision.storage.number_columns import Numbers, number_block, numbers_in
from fingervision.storage.plain_file import NotUtf8Error, text_of, why

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

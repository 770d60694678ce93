"""Text format (dialect) of a table: separator and decimal mark, recognised from its lines; cells as numbers."""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.numbers import GROUPED, MINUS, to_number
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.questions import Question, Reading, asked, span

COMMENT_MARKS = ("#", "%", "//", "!", "'")
NAMES = {"\t": "tab", ";": "semicolon", "|": "bar", ",": "comma", None: "blanks"}
"""Separators, most probable first: a mark of the first kinds that occurs in every line is almost always the
separator."""
BY_NAME = {"tab": "\t", "\t": "\t", ";": ";", "semicolon": ";", "|": "|", "bar": "|", ",": ",", "comma": ","}
BY_NAME_OR_BLANK: dict[str, str | None] = {**BY_NAME, "blank": None, "blanks": None, " ": None}
MISSING = frozenset(
    ["", "nan", "na", "n/a", "null", "none", "-", "--", "---", "#n/a", "#nv", "#na", "1.#qnan", "-1.#ind", "1.#ind"]
)
"""Texts that programs write for a missing number, in lower case."""
NO_NUMBER = 9.9e37
"""Smallest number that means infinity (9.9e37) or not a number (9.91e37) in the output of an instrument (SCPI 1999,
section 7.2.1)."""
NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eEdD][+-]?\d+)?"),
}
UNIT_BEHIND = re.compile(r"(?<=\d)\s?(?:[mµμun]?m|[mµμun]?s|[mk]?N)$")
"""A unit behind a number in the same cell: `0.61 mm`, `100ms`."""
THOUSANDS = {",": re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+"), ".": re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+")}
"""Patterns of numbers whose mark may be either a thousands separator or a decimal mark."""
DATE_LIKE = re.compile(r"[\d./\-]+([T ]\d.*)?|\d{1,2}:\d{2}(:\d{2}([.,]\d*)?)?( ?[AaPp][Mm])?Z?")
SAMPLE_LINES = 2000
QUOTED_LINES = 5
"""Last lines of the sample that must have quotes, if a comma separates cells and is the decimal mark too."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """Separator and decimal mark of a text table.

    Parameters
    ----------
    separator : str or None
        Separator between two cells; None for any white space.
    decimal : str
        Decimal mark: `.` or `,`.
    wide : int
        Number of cells in a row.
    either_way : bool
        Whether the only mark in the numbers may be either a decimal mark or a thousands separator.
    """

    separator: str | None
    decimal: str
    wide: int
    either_way: bool = False

    @property
    def words(self) -> str:
        """Description of the dialect for messages."""
        return f"separator {NAMES[self.separator]}, decimal {'point' if self.decimal == '.' else 'comma'}"


def split(line: str, separator: str | None) -> list[str]:
    """Split a line into cells, without quotes."""
    if separator is None:
        return line.split()
    if '"' in line:
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]
        except csv.Error:
            pass
    return [cell.strip() for cell in line.split(separator)]


BORDER = re.compile(r"\s*[+|=:\-]*--[+|=:\-\s]*|\s*={3,}[=\s]*|\s*_{3,}[_\s]*")
"""A ruled line, as of a printed table (`+-----+-----+`)."""


def is_comment(line: str) -> bool:
    """Whether a line is marked as a comment, or is a ruled line."""
    return line.lstrip().startswith(COMMENT_MARKS) or BORDER.fullmatch(line) is not None


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with the given decimal mark."""
    cell = cell.translate(MINUS)
    if NUMBER[decimal].fullmatch(cell) is not None or GROUPED[decimal].fullmatch(cell) is not None:
        return True
    return (unit := UNIT_BEHIND.search(cell)) is not None and NUMBER[decimal].fullmatch(
        cell[: unit.start()]
    ) is not None


def is_value(cell: str, decimal: str) -> bool:
    """Whether a cell is a valid entry below a header: a number, empty, or a date."""
    return cell.lower() in MISSING or is_number(cell, decimal) or DATE_LIKE.fullmatch(cell) is not None


def find_dialect(lines: Sequence[str], separator: str = "", decimal: str = "") -> Dialect | None:
    """Find the dialect in which most cells of most lines are numbers; None if no line has two cells.

    Parameters
    ----------
    lines : sequence of str
        All lines of the file.
    separator, decimal : str
        Marks stated by the user (keys of columns.toml); empty if they are to be recognised.
    """
    sample = [line for line in lines[:SAMPLE_LINES] if line.strip() and not is_comment(line)]
    separators = list(NAMES) if not separator else [BY_NAME_OR_BLANK[separator]]
    best: tuple[float, Dialect] | None = None
    for between in separators:
        rows = [split(line.translate(MINUS), between) for line in sample]
        for mark in (decimal,) if decimal else (".", ","):
            # Spreadsheets put decimal commas between commas into quotes.
            if mark == between == "," and not all('"' in line for line in sample[-QUOTED_LINES:]):
                continue
            found = _explained(rows, mark)
            # Among equal results the first is taken: the more probable separator, and the decimal point.
            if found is not None and (best is None or found[0] > best[0] + 1e-9):
                best = found[0], Dialect(between, mark, found[1])
    if best is None:
        return None
    dialect = best[1]
    rows = [row for line in sample if len(row := split(line, dialect.separator)) == dialect.wide]
    either = not decimal and _either_way([cell for row in rows for cell in row], dialect)
    return Dialect(dialect.separator, dialect.decimal, dialect.wide, either)


def _explained(rows: Sequence[Sequence[str]], decimal: str) -> tuple[float, int] | None:
    """Fraction of cells that are valid values, in rows of the most frequent length, and this length."""
    numeric = [(len(row), sum(is_number(cell, decimal) for cell in row), row) for row in rows]
    lengths = Counter(length for length, numbers, _ in numeric if length > 1 and numbers)
    if not lengths:
        return None
    wide = max(lengths, key=lambda length: (lengths[length], length))
    used = [(numbers, row) for length, numbers, row in numeric if length == wide and numbers]
    values = sum(numbers + sum(is_value(cell, decimal) for cell in row) for numbers, row in used)
    return values / (2.0 * wide * len(used)) * (len(used) / len(rows)) ** 0.5, wide


def _either_way(cells: Sequence[str], dialect: Dialect) -> bool:
    """Whether all numbers with a mark could be either integers with a thousands separator or decimal numbers.

    A point is ambiguous only if semicolons separate the cells, because programs with decimal commas use points as
    thousands separators.
    """
    numbers = [cell.translate(MINUS) for cell in cells if is_number(cell, dialect.decimal)]
    marks = {mark for mark in ".," if any(mark in number for number in numbers)}
    if len(marks) != 1 or (marks == {"."} and dialect.separator != ";"):
        return False
    mark = marks.pop()
    return all(THOUSANDS[mark].fullmatch(number) for number in numbers if mark in number)


# Convert cells of text to numbers, with the decimal mark of their table.


def to_numbers(cells: Sequence[str], decimal: str) -> tuple[Numbers, NDArray[np.intp]]:
    """Read cells as numbers.

    Parameters
    ----------
    cells : sequence of str, length n
        Cells without surrounding white space.
    decimal : str
        Decimal mark: `.` or `,`.

    Returns
    -------
    Numbers
        Numbers of length n; cells without a number are marked as missing.
    ndarray of int
        Rows whose cell is neither a number nor a usual word for a missing value.
    """
    try:
        dotted = [cell for cell in cells if "." in cell] if decimal == "," else []
        # Beside decimal commas in other columns, `1.000` is a thousand; a column with `0.500` has decimal points.
        grouped = bool(dotted) and all(THOUSANDS["."].fullmatch(cell) for cell in dotted)
        if decimal == "," and (grouped or any("," in cell for cell in cells)):
            if dotted:
                raise ValueError  # noqa: TRY301 - points would be read as decimal points: the cells are read one by one
            value = np.array([float(cell.replace(",", ".")) for cell in cells], dtype=np.float64)
        else:
            value = np.array(list(map(float, cells)), dtype=np.float64)
        if np.all(np.isfinite(value)):
            return Numbers.whole(value), np.zeros(0, dtype=np.intp)
    except ValueError:
        pass
    value, present = np.zeros(len(cells)), np.zeros(len(cells), dtype=np.bool_)
    odd = []
    for row, cell in enumerate(cells):
        number: float | None
        try:
            number = float(cell) if decimal == "." else float(cell.replace(",", ".") if "." not in cell else "?")
        except ValueError:
            number = to_number(cell, decimal)
        if number is not None and isfinite(number):
            value[row], present[row] = number, True
        elif cell.strip().lower() not in MISSING:
            odd.append(row)
    return Numbers(value, present), np.array(odd, dtype=np.intp)


def which_mark(cells: Sequence[str]) -> Question:
    """Question whether the only mark in numbers is the decimal sign or separates thousands."""
    marked = [cell for cell in cells if any(mark in cell and THOUSANDS[mark].fullmatch(cell) for mark in ",.")]
    mark, other, name = (",", ".", "comma") if "," in marked[0] else (".", ",", "point")
    readings = [
        Reading(f"decimal={sign}", f"'{marked[0]}' is {to_number(marked[0], sign):g}, and all such numbers are "
                f"{span(to_numbers(marked, sign)[0].value)}")
        for sign in (mark, other)
    ]  # fmt: skip
    return asked(f"each {name} in the numbers may be the decimal sign or a thousands separator", readings)

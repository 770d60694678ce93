"""Convert lines of text to a raw table: header, units, comments, repeated headers, and lines that are not rows."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.numbers import MINUS
from fingervision.storage.csv_columns import Numbers, number_block
from fingervision.tables.dialect import (
    BY_NAME,
    SAMPLE_LINES,
    Dialect,
    find_dialect,
    is_comment,
    is_number,
    is_value,
    split,
    which_mark,
)
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.raw_table import RawColumn, RawTable, check_columns
from fingervision.tables.text_header import (
    HEADER_LINES,
    Header,
    find_header,
    first_row,
    header_below_values,
    is_other_header,
    names_in,
    other_header,
    statistics_below,
)
from fingervision.tables.times import looks_like_time
from fingervision.tables.units import column_name, known_unit
from fingervision.tables.words import role_of

# Text logs in which each number has its name before it: `t=0.100 x=0.61 gap=4.2`, as microcontrollers print.

PAIR = re.compile(
    r"(?<!\d{4}-\d\d-\d\d)([^\W\d]\w*)\s*[=:]\s*([+-]?(?:\d+(?:\.\d*|,\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?)(?:\s*([^\W\d_]+)(?!\w*\s*[=:]))?"
)
"""A name, a number, and a unit, which is not the name of the next number. `T13:24` of a date and time is no pair."""
MOST_OTHER = 0.05
"""Largest share of lines without these names: a start-up message, and a line that was cut off."""
FEWEST_LINES = 3


def rows_of_pairs(lines: Sequence[str]) -> list[str] | None:
    """Write such a log as a table with tabs; None if the lines are no such log.

    A line that differs becomes a comment, so that the rows keep their line numbers.
    """
    told = [line for line in lines if line.strip() and not is_comment(line)]
    first = next((found for line in told[:FEWEST_LINES] if len(found := PAIR.findall(line)) > 1), None)
    if first is None or len(told) < FEWEST_LINES:
        return None
    names = [(name, unit if known_unit(unit) else "") for name, _, unit in first]
    # The serial monitor of the Arduino IDE writes the time of day before each line: `13:24:07.123 -> x=0.61`.
    stamped = "time" not in [role_of(name) for name, _ in names] and all(
        _stamp(line) for line in told if len(PAIR.findall(line)) == len(names)
    )
    out: list[str] = []
    rows = 0
    for line in lines:
        found = [] if is_comment(line) else PAIR.findall(line)
        same = [(name, unit if known_unit(unit) else "") for name, _, unit in found] == names
        rows += same
        values = [*([_stamp(line)] if stamped else []), *(value for _, value, _ in found)]
        out.append("\t".join(values) if same else f"# {line}" if line.strip() else "")
    if rows < FEWEST_LINES or len(told) - rows > max(1.0, MOST_OTHER * len(told)):
        return None
    if stamped:
        names = [("time", ""), *names]
    return ["\t".join(f"{name} [{unit}]" if unit else name for name, unit in names), *out]


def _stamp(line: str) -> str:
    """Date or time of day before the first pair of a line; empty if there is none."""
    first = PAIR.search(line)
    before = line[: first.start()].strip(" \t[](){}<>|;,-=") if first is not None else ""
    return before if before and looks_like_time([before]) else ""


# Text tables in which each line holds a column.

MOST_LINES = 12
"""Largest number of lines of a table with one column per line, and smallest ratio of its columns to its lines."""
LEAST_RATIO = 3


def exchanged(lines: Sequence[str], dialect: Dialect) -> list[str] | None:
    """Exchange rows and columns if each line is a name of a known role and many numbers; None for any other table."""
    if dialect.separator is None:
        return None
    told = [line for line in lines[: 2 * MOST_LINES] if line.strip() and not is_comment(line)]
    cells = [split(line, dialect.separator) for line in told]
    if not 2 <= len(cells) <= MOST_LINES or len(lines) > 2 * MOST_LINES:
        return None
    wide = dialect.wide
    if wide < LEAST_RATIO * len(cells) or any(len(row) != wide for row in cells):
        return None
    if any(not all(is_value(cell, dialect.decimal) for cell in row[1:]) for row in cells):
        return None
    if sum(column_name(row[0]).role is not None for row in cells) < 2:
        return None
    return [dialect.separator.join(column) for column in zip(*cells, strict=True)]


NUMBER_BEGINS = frozenset("0123456789+-., \t")
BETWEEN = re.compile(r"[\s,;|]+")
MOST_PROSE = 0.5
"""Largest fraction of lines without numbers: notes of a logger between the rows are fewer, whereas nearly all lines of
a prose text are such lines."""
MOST_ODD = 0.05
"""Largest fraction of rows with another number of cells; a larger fraction indicates a wrong separator instead of
occasional errors of a logger."""


def table_of_lines(path: Path, lines: Sequence[str], given: Entry, encoding: str) -> RawTable:
    """Find header and rows in the lines of a file, and read the rows.

    Parameters
    ----------
    path : Path
        The file.
    lines : sequence of str
        All lines of the file.
    given : Entry
        Decisions of the user.
    encoding : str
        Name of the text encoding, for the description of the format.

    Raises
    ------
    DataError
        The lines contain no table, or too many lines do not fit its columns.
    OpenQuestionError
        A mark in the numbers may be a decimal sign or a thousands separator.
    """
    if "separator" not in given.words and (pairs := rows_of_pairs(lines)) is not None:
        whole = table_of_lines(path, pairs, replace(given, words={**given.words, "separator": "tab"}), encoding)
        settings = {key: whole.settings[key] for key in ("decimal", "encoding")}
        # The names were put before the first line.
        return replace(whole, lines=[number - 1 for number in whole.lines], settings=settings)
    dialect = find_dialect(lines, given.words.get("separator", ""), given.words.get("decimal", ""))
    if dialect is None:
        raise DataError(
            f"{path} must hold rows of two numbers or more, but has none in its {len(lines)} lines: name another file, "
            "or export the table again."
        )
    if (turned := exchanged(lines, dialect)) is not None:
        whole = table_of_lines(path, turned, given, encoding)
        note = "Each line holds a column, with its name first: rows and columns are exchanged."
        return replace(whole, lines=(), notes=(note, *whole.notes))
    check_columns(path, dialect.wide)
    at = given if given.header_line is not None else replace(given, header_line=header_below_values(lines, dialect))
    first = first_row(lines, dialect, at)
    header = find_header(lines, first, dialect, at)
    if not header.names:
        _check_commas(path, lines, first, dialect)
    if dialect.either_way:
        rows_of_cells = [
            cells for line in lines[first:] if len(cells := split(line, dialect.separator)) == dialect.wide
        ]
        raise OpenQuestionError(path, "table", [which_mark([cell for row in rows_of_cells for cell in row])])
    rows = _Rows(path, dialect, header, first, is_part=given.header_line is not None)
    columns, numbers, left_out, restarts = rows.read(lines)
    notes = () if header.names else (f"The file has no column names: its columns are named 1 to {len(columns)}.",)
    return RawTable(
        path,
        f"text, {encoding}, {dialect.words}",
        tuple(columns),
        numbers,
        tuple(left_out),
        notes,
        np.array(restarts, dtype=np.intp),
        {**_settings(dialect, header), "encoding": encoding},
        bool(header.names),
    )


def _settings(dialect: Dialect, header: Header) -> dict[str, str | int]:
    word = next((name for name, sign in BY_NAME.items() if sign == dialect.separator and sign != name), None)
    separator = "blank" if dialect.separator is None else "tab" if word == "tab" else dialect.separator
    return {"separator": separator, "decimal": dialect.decimal, "header_line": header.line + 1}


def _check_commas(path: Path, lines: Sequence[str], first: int, dialect: Dialect) -> None:
    """Refuse rows in which commas are both decimal marks and separators, without quotes.

    They have twice as many cells as column names; without names, every second cell is a group of digits of one length
    that may begin with a zero (`0,067,1,250`).
    """
    if dialect.separator != "," or dialect.wide % 2:
        return
    rows = [split(line, ",") for line in lines[first : first + SAMPLE_LINES]]
    fractions = [cell for row in rows if len(row) == dialect.wide for cell in row[1::2]]
    are_digits = all(map(str.isdecimal, fractions)) and len(set(map(len, fractions))) == 1
    headers = [split(line, ",") for line in lines[max(0, first - HEADER_LINES) : first]]
    halves = [2 * len(names) == dialect.wide and not any(is_value(name, ".") for name in names) for names in headers]
    if any(halves) or (are_digits and any(len(cell) > 1 and cell[0] == "0" for cell in fractions)):
        raise DataError(
            f"{path} has {dialect.wide} cells a row between commas, twice as many as it has columns: decimal commas "
            "and commas between cells cannot be distinguished. Export the table with semicolons or tabs between the "
            "cells."
        )


class _Rows:
    """Reads the lines below the header."""

    def __init__(self, path: Path, dialect: Dialect, header: Header, first: int, *, is_part: bool) -> None:
        self._path, self._dialect, self._header, self._first, self._is_part = path, dialect, header, first, is_part
        self._names = header.names or tuple(str(k + 1) for k in range(dialect.wide))
        self._units = header.units or ("",) * dialect.wide

    def read(self, lines: Sequence[str]) -> tuple[list[RawColumn], Sequence[int], list[str], list[int]]:
        """Return columns, line numbers of the rows, omitted lines, and rows before which the header was repeated."""
        end = len(lines)
        while end > self._first and not lines[end - 1].strip():
            end -= 1
        body = lines[self._first : end]
        if (block := self._block(body)) is not None:
            columns = [self._column(k, Numbers.whole(values)) for k, values in enumerate(block.T.copy())]
            return columns, range(self._first + 1, end + 1), [], []
        return self._cell_by_cell(body)

    def _column(self, place: int, content: Sequence[str] | Numbers) -> RawColumn:
        return RawColumn(self._names[place], content, self._units[place])

    def _block(self, body: Sequence[str]) -> np.ndarray | None:
        if self._dialect.decimal == ",":
            if any("." in line for line in body):
                return None
            body = [line.replace(",", ".") for line in body]
        return number_block(body, self._dialect.separator, self._dialect.wide)

    def _cell_by_cell(self, body: Sequence[str]) -> tuple[list[RawColumn], Sequence[int], list[str], list[int]]:
        found = self._sorted(body)
        if found.other is not None and not self._is_part:
            raise OpenQuestionError(self._path, "table", [other_header(self._header.line + 1, found.other)])
        rows, wide = found.rows, self._dialect.wide
        statistics = statistics_below(rows)
        del rows[len(rows) - statistics :], found.numbers[len(found.numbers) - statistics :]
        if len(found.odd) > max(1.0, MOST_ODD * len(rows)):
            raise self._too_many_odd(body, found)
        cleaned = ([row[k].strip() for row in rows] for k in range(wide))
        if not all(map(str.isascii, body)):
            cleaned = ([cell.translate(MINUS) for cell in cells] for cells in cleaned)
        columns = [self._column(k, cells) for k, cells in enumerate(cleaned)]
        restarts = sorted({row for row in found.restarts if 0 < row < len(rows)})
        return columns, found.numbers, found.left_out(statistics, wide), restarts

    def _sorted(self, body: Sequence[str]) -> "_Lines":
        """Tell rows from comments, repeated headers and lines with another number of cells."""
        separator, wide = self._dialect.separator, self._dialect.wide
        names, units = [name.strip() for name in self._names], list(self._units)
        found = _Lines()
        plain = separator is not None and not any('"' in text for text in body)
        for line, text in enumerate(body, start=self._first + 1):
            cells = text.split(separator) if plain else split(text, separator)
            if len(cells) == wide and text[0] not in "#%/!'" and any(cells):
                if text[0] not in NUMBER_BEGINS and not is_number(cells[0].strip(), self._dialect.decimal):
                    if self._is_header(cells, names, units):
                        found.header(line)
                        continue
                    if self._header.names and is_other_header(cells, names, units, self._dialect.decimal):
                        found.other = line
                        break
                found.rows.append(cells)
                found.numbers.append(line)
            elif not text.strip():
                continue
            elif is_comment(text):
                found.comments.append(line)
                if self._header.names and names_in(text, self._dialect) == self._header.names:
                    found.restarts.append(len(found.rows))
            elif cells == names or cells[:wide] == names:
                found.header(line)
            else:
                found.odd.append((line, len(cells)))
        return found

    def _too_many_odd(self, body: Sequence[str], found: "_Lines") -> DataError:
        """Return the error of a text in which too many lines have another number of cells."""
        told = [text for text in body if text.strip() and not is_comment(text)]
        prose = sum(_is_prose(text, self._dialect.decimal) for text in told)
        if prose > MOST_PROSE * len(told):
            return DataError(
                f"{self._path} is not a table: {prose} of its {len(told)} lines from line {self._first + 1} on are "
                "words, and a table has rows of two numbers or more. Name the file that holds the table."
            )
        return DataError(
            f"{self._path} must have {self._dialect.wide} cells in each row below line {self._first}, but "
            f"{len(found.odd)} of {len(found.rows) + len(found.odd)} rows do not (line {found.odd[0][0]} has "
            f"{found.odd[0][1]}): correct them, or state the key separator in columns.toml."
        )

    def _is_header(self, cells: Sequence[str], names: Sequence[str], units: Sequence[str]) -> bool:
        """Whether a row repeats the header, even in another spelling, or the row of units."""
        cells = [cell.strip() for cell in cells]
        if cells in (names, units):
            return True
        if is_other_header(cells, names, units, self._dialect.decimal):
            return False
        same = sum(a.lower() == b.lower() for a, b in zip(cells, names, strict=True))
        return same > len(cells) // 2 and not any(is_number(cell, self._dialect.decimal) for cell in cells)


@dataclass(slots=True)
class _Lines:
    """Lines of a text, sorted by what they hold.

    Parameters
    ----------
    rows : list of list of str
        Cells of each row.
    numbers : list of int
        Number of the line of each row.
    restarts : list of int
        Rows before which the header was repeated.
    comments, headers : list of int
        Numbers of the lines of comment and of repeated headers.
    odd : list of (int, int)
        Lines with another number of cells: number of the line, and of its cells.
    other : int or None
        Number of the line on which the header of another table begins.
    """

    rows: list[list[str]] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    restarts: list[int] = field(default_factory=list)
    comments: list[int] = field(default_factory=list)
    headers: list[int] = field(default_factory=list)
    odd: list[tuple[int, int]] = field(default_factory=list)
    other: int | None = None

    def header(self, line: int) -> None:
        """Add a line that repeats the header."""
        self.headers.append(line)
        self.restarts.append(len(self.rows))

    def left_out(self, statistics: int, wide: int) -> list[str]:
        """Say which lines are not read as rows."""
        said = []
        if self.comments:
            said.append(f"{_count(len(self.comments), 'line')} of comment (the first is line {self.comments[0]})")
        if self.headers:
            said.append(f"{_count(len(self.headers), 'repeated header line')} (the first is line {self.headers[0]})")
        if statistics:
            said.append(f"{_count(statistics, 'row')} of statistics below the values")
        if self.other is not None:
            said.append(f"everything from line {self.other} on, where other column names begin")
        if self.odd:
            said.append(
                f"{_count(len(self.odd), 'line')} with another number of cells (line {self.odd[0][0]} has "
                f"{self.odd[0][1]}, not {wide})"
            )
        return said


def _is_prose(text: str, decimal: str) -> bool:
    """Whether most of a line's text is no number, date or empty cell."""
    parts = BETWEEN.split(text.strip())
    return sum(is_value(part, decimal) for part in parts) < 0.5 * len(parts)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' if number != 1 else ''}"

"""Convert lines of text to a raw table: header, units, comments, repeated headers, and lines that are not rows."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.numbers import MINUS
from fingervision.storage.number_block import number_block
from fingervision.storage.number_columns import Numbers
from fingervision.tables.cells import which_mark
from fingervision.tables.dialect import (
    BY_NAME,
    SAMPLE_LINES,
    Dialect,
    find_dialect,
    is_comment,
    is_number,
    is_value,
    split,
)
from fingervision.tables.exchanged_rows import exchanged
from fingervision.tables.header_pairs import Header
from fingervision.tables.key_value_rows import rows_of_pairs
from fingervision.tables.mapping import Entry
from fingervision.tables.other_rows import is_other_header, other_header, statistics_below
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.raw_table import RawColumn, RawTable, check_columns
from fingervision.tables.text_header import HEADER_LINES, find_header, first_row, header_below_values, names_in

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
        separator, wide = self._dialect.separator, self._dialect.wide
        names = [name.strip() for name in self._names]
        rows: list[list[str]] = []
        numbers: list[int] = []
        restarts: list[int] = []
        other: int | None = None
        comments: list[int] = []
        headers: list[int] = []
        odd: list[tuple[int, int]] = []
        units = list(self._units)
        plain = separator is not None and not any('"' in text for text in body)
        ascii_only = all(map(str.isascii, body))
        for line, text in enumerate(body, start=self._first + 1):
            cells = text.split(separator) if plain else split(text, separator)
            if len(cells) == wide and text[0] not in "#%/!'" and any(cells):
                if text[0] not in NUMBER_BEGINS and not is_number(cells[0].strip(), self._dialect.decimal):
                    if self._is_header(cells, names, units):
                        headers.append(line)
                        restarts.append(len(rows))
                        continue
                    if self._header.names and is_other_header(cells, names, units, self._dialect.decimal):
                        other = line
                        break
                rows.append(cells)
                numbers.append(line)
            elif not text.strip():
                continue
            elif is_comment(text):
                comments.append(line)
                if self._header.names and names_in(text, self._dialect) == self._header.names:
                    restarts.append(len(rows))
            elif cells == names or cells[:wide] == names:
                headers.append(line)
                restarts.append(len(rows))
            else:
                odd.append((line, len(cells)))
        if other is not None and not self._is_part:
            raise OpenQuestionError(self._path, "table", [other_header(self._header.line + 1, other)])
        statistics = statistics_below(rows)
        del rows[len(rows) - statistics :], numbers[len(numbers) - statistics :]
        if len(odd) > max(1.0, MOST_ODD * len(rows)):
            told = [text for text in body if text.strip() and not is_comment(text)]
            prose = sum(_is_prose(text, self._dialect.decimal) for text in told)
            if prose > MOST_PROSE * len(told):
                raise DataError(
                    f"{self._path} is not a table: {prose} of its {len(told)} lines from line {self._first + 1} on are "
                    "words, and a table has rows of two numbers or more. Name the file that holds the table."
                )
            raise DataError(
                f"{self._path} must have {wide} cells in each row below line {self._first}, but {len(odd)} of "
                f"{len(rows) + len(odd)} rows do not (line {odd[0][0]} has {odd[0][1]}): correct them, or state the "
                "key separator in columns.toml."
            )
        left_out = []
        if comments:
            left_out.append(f"{_count(len(comments), 'line')} of comment (the first is line {comments[0]})")
        if headers:
            left_out.append(f"{_count(len(headers), 'repeated header line')} (the first is line {headers[0]})")
        if statistics:
            left_out.append(f"{_count(statistics, 'row')} of statistics below the values")
        if other is not None:
            left_out.append(f"everything from line {other} on, where other column names begin")
        if odd:
            left_out.append(
                f"{_count(len(odd), 'line')} with another number of cells (line {odd[0][0]} has {odd[0][1]}, not "
                f"{wide})"
            )
        cleaned = ([row[k].strip() for row in rows] for k in range(wide))
        if not ascii_only:
            cleaned = ([cell.translate(MINUS) for cell in cells] for cells in cleaned)
        columns = [self._column(k, cells) for k, cells in enumerate(cleaned)]
        return columns, numbers, left_out, sorted({row for row in restarts if 0 < row < len(rows)})

    def _is_header(self, cells: Sequence[str], names: Sequence[str], units: Sequence[str]) -> bool:
        """Whether a row repeats the header, even in another spelling, or the row of units."""
        cells = [cell.strip() for cell in cells]
        if cells in (names, units):
            return True
        if is_other_header(cells, names, units, self._dialect.decimal):
            return False
        same = sum(a.lower() == b.lower() for a, b in zip(cells, names, strict=True))
        return same > len(cells) // 2 and not any(is_number(cell, self._dialect.decimal) for cell in cells)


def _is_prose(text: str, decimal: str) -> bool:
    """Whether most of a line's text is no number, date or empty cell."""
    parts = BETWEEN.split(text.strip())
    return sum(is_value(part, decimal) for part in parts) < 0.5 * len(parts)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' if number != 1 else ''}"

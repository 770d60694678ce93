"""Excel workbooks (.xlsx, .xlsm): the values of one sheet; no macro is executed and no formula is computed."""

import zipfile
from collections.abc import Sequence
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.storage.number_columns import Numbers
from fingervision.tables.cells import which_mark
from fingervision.tables.column_names import column_name
from fingervision.tables.dialect import THOUSANDS, is_number
from fingervision.tables.mapping import Entry
from fingervision.tables.needed_library import needed_library
from fingervision.tables.other_rows import statistics_below
from fingervision.tables.parts import chosen_part
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.units import is_unit

# Numbers that a workbook stores as text, as it does for values pasted or imported in another locale.


def is_number_text(cell: object) -> bool:
    """Whether a cell holds a number as text, with either decimal mark.

    Examples
    --------
    >>> is_number_text("0,61"), is_number_text("0.61"), is_number_text("Gap"), is_number_text(0.61)
    (True, True, False, False)
    """
    return isinstance(cell, str) and any(is_number(cell.strip(), mark) for mark in ".,")


def decimal_of_texts(path: Path, rows: Sequence[Sequence[object]], given: Entry) -> str:
    """Decimal mark of the numbers that are stored as text; a point if there are none.

    Raises
    ------
    OpenQuestionError
        Each comma may be a decimal mark or separate thousands.
    """
    if "decimal" in given.words:
        return given.words["decimal"]
    marked = [text for row in rows for cell in row if isinstance(cell, str) and "," in (text := cell.strip())]
    commas = [text for text in marked if is_number(text, ",")]
    if not commas:
        return "."
    if all(THOUSANDS[","].fullmatch(text) for text in commas):
        raise OpenQuestionError(path, "table", [which_mark(commas)])
    return ","


ORDER = 20
MOST_UNPACKED_BYTES = 600_000_000
"""Largest unpacked size: a full sheet (1 048 576 rows) of six columns has about 250 MB of XML, and a much larger
archive is not a measured table but perhaps an archive bomb."""
MOST_SHARED_BYTES = 100_000_000
"""Largest total size of the texts of cells, all of which are kept in memory."""
HEADER_ROWS = 60
MOST_STATISTICS = 30
"""Number of last rows that are searched for statistics."""
EPOCH = datetime(1900, 1, 1)


def recognises(path: Path, head: bytes) -> bool:
    """Whether the file is a workbook, from the content of its archive."""
    if not head.startswith(b"PK"):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return "xl/workbook.xml" in archive.namelist()
    except (OSError, zipfile.BadZipFile, ValueError):
        return path.suffix.lower() in (".xlsx", ".xlsm")


def read(path: Path, given: Entry) -> RawTable:
    """Read the selected sheet of the workbook."""
    library = needed_library("openpyxl", path, "an Excel workbook")
    _check_archive(path)
    book = library.load_workbook(path, read_only=True, data_only=True, keep_links=False)
    try:
        sheets = {sheet.title: sheet for sheet in book.worksheets}
        names = {
            title: named
            for title, sheet in sheets.items()
            if (named := _best_names(list(sheet.iter_rows(max_row=HEADER_ROWS, values_only=True))))
        }
        title = chosen_part(path, names, given, "sheet")
        rows = list(sheets[title].iter_rows(values_only=True))
        place = book.sheetnames.index(title)
    finally:
        book.close()
    return _table(path, rows, title, given, _Sheet(path, title, place, library))


def _check_archive(path: Path) -> None:
    """Refuse archives that unpack to an unreasonable size, and XML that defines entities."""
    with zipfile.ZipFile(path) as archive:
        infos = archive.infolist()
        total = sum(info.file_size for info in infos)
        shared = sum(info.file_size for info in infos if "sharedStrings" in info.filename)
        if total > MOST_UNPACKED_BYTES or shared > MOST_SHARED_BYTES:
            raise DataError(
                f"{path} must unpack to at most {MOST_UNPACKED_BYTES / 1e6:.0f} MB, at most "
                f"{MOST_SHARED_BYTES / 1e6:.0f} MB of them texts, but would unpack to {total / 1e6:.0f} MB with "
                f"{shared / 1e6:.0f} MB of texts: save the table as CSV or Parquet."
            )
        for info in infos:
            if info.filename.endswith((".xml", ".rels")):
                with archive.open(info) as part:
                    if b"<!DOCTYPE" in part.read(4096):
                        raise DataError(
                            f"{path} must be a workbook as Excel writes it, but {info.filename} in it defines XML "
                            "entities, which a workbook never needs: save it again with Excel or LibreOffice."
                        )


def _is_value(cell: object) -> bool:
    return isinstance(cell, int | float | datetime | date | time | timedelta) and not isinstance(cell, bool)


def _first_row(rows: Sequence[tuple[Any, ...]]) -> int | None:
    """Find the first row with at least two values, or with two texts that are numbers if no row has values."""
    for kind in (_is_value, is_number_text):
        found = next((at for at, row in enumerate(rows) if sum(map(kind, row)) >= 2), None)
        if found is not None:
            return found
    return None


def _best_names(rows: Sequence[tuple[Any, ...]]) -> list[str]:
    """Column names above the first row of a sheet; column numbers if there are no names."""
    first = _first_row(rows)
    if first is None:
        return []
    above = [[str(cell).strip() for cell in row if cell is not None] for row in rows[:first]]
    named = [row for row in above if len(row) >= 2]
    if not named:
        return [str(k + 1) for k, cell in enumerate(rows[first]) if _is_value(cell) or is_number_text(cell)]
    return max(named, key=lambda row: sum(column_name(cell).role is not None for cell in row))


class _Sheet:
    """Information on a sheet that openpyxl's fast reader omits: merged cells, and formulas without a value."""

    def __init__(self, path: Path, title: str, place: int, library: Any) -> None:
        self.path, self.title, self._place, self._library = path, title, place, library

    def merged(self) -> list[tuple[int, int, int, int]]:
        """Return first and last row and column (from 1) of each merged range."""
        from re import findall

        book = self._library.load_workbook(self.path, read_only=True, keep_links=False)
        try:
            name = book.worksheets[self._place]._worksheet_path  # noqa: SLF001 - openpyxl has no public name for it
        finally:
            book.close()
        with zipfile.ZipFile(self.path) as archive, archive.open(name) as part:
            tail = b""
            found: list[bytes] = []
            while block := part.read(1 << 20):
                found += findall(rb'<(?:\w+:)?mergeCell\s+ref="([A-Z0-9:]+)"', tail + block)
                tail = block[-200:]
        bounds = self._library.utils.range_boundaries
        return [(r0, r1, c0, c1) for ref in set(found) for c0, r0, c1, r1 in [bounds(ref.decode())]]

    def formula(self, row: int, column: int) -> bool:
        """Whether a cell (row and column from 1) contains a formula."""
        book = self._library.load_workbook(self.path, read_only=True, keep_links=False)
        try:
            sheet = book.worksheets[self._place]
            cell = next(sheet.iter_rows(min_row=row, max_row=row, min_col=column, max_col=column, values_only=True))[0]
            return isinstance(cell, str) and cell.startswith("=")
        finally:
            book.close()


def _table(path: Path, rows: Sequence[tuple[Any, ...]], title: str, given: Entry, sheet: _Sheet) -> RawTable:
    first = _first_row(rows) if given.header_line is None else given.header_line
    if first is None or first >= len(rows):
        raise DataError(f"{path} must hold rows of two numbers or more in sheet '{title}', but has none.")
    names, units, header_line = _header(rows, first, given)
    if units and first == header_line:
        first += 1
    places = [k for k in range(max(len(row) for row in rows)) if k < len(names) and names[k]] or list(
        range(len(rows[first]))
    )
    for r0, r1, c0, c1 in sheet.merged():
        if r1 > first and any(c0 - 1 <= k <= c1 - 1 for k in places) and (r1 > r0 or c1 > c0):
            raise DataError(
                f"Sheet '{title}' of {path} must have one cell per value, but rows {r0} to {r1}, columns {c0} to {c1} "
                "are merged into one: unmerge them, so that each row has its own value."
            )
    body, lines, blank, headers = [], [], 0, []
    for at in range(first, len(rows)):
        row = rows[at]
        cells = [row[k] if k < len(row) else None for k in places]
        if all(cell is None or cell == "" for cell in cells):
            blank += 1
        elif names and [str(cell).strip() for cell in cells] == [names[k] for k in places]:
            headers.append(at + 1)
        else:
            body.append(cells)
            lines.append(at + 1)
    last = [["" if cell is None else str(cell) for cell in row] for row in body[-MOST_STATISTICS:]]
    statistics = statistics_below(last)
    del body[len(body) - statistics :], lines[len(lines) - statistics :]
    decimal = decimal_of_texts(path, body, given)
    columns = []
    for at, k in enumerate(places):
        cells = [row[at] for row in body]
        empty = [n for n, cell in enumerate(cells) if cell is None]
        if empty and sheet.formula(lines[empty[0]], k + 1):
            raise DataError(
                f"The cell in row {lines[empty[0]]}, column {k + 1} of sheet '{title}' of {path} holds a formula whose "
                "value was never calculated: open the workbook in Excel or LibreOffice, save it, and read it again."
            )
        columns.append(
            _column(names[k] if k < len(names) else str(k + 1), units[k] if k < len(units) else "", cells, decimal)
        )
    left_out = [f"{len(headers)} repeated header lines (the first is row {headers[0]})"] if headers else []
    if statistics:
        left_out.append(f"{statistics} row{'s' * (statistics > 1)} of statistics below the values")
    return RawTable(
        path,
        f"Excel workbook, sheet '{title}'" + (", without its macros" if path.suffix.lower() == ".xlsm" else ""),
        tuple(columns),
        lines,
        tuple(left_out),
        () if names else ("The sheet has no column names: its columns are named by their numbers.",),
        settings={"part": title, **({"decimal": decimal} if decimal != "." else {})},
        named=bool(names),
    )


def _header(rows: Sequence[tuple[Any, ...]], first: int, given: Entry) -> tuple[list[str], list[str], int]:
    """Return column names, units, and the number of the row with the names (from 1; 0 without names)."""
    above = {
        at: [("" if cell is None else str(cell).strip()) for cell in rows[at]]
        for at in (range(max(0, first - 6), first) if given.header_line is None else [given.header_line - 1])
        if at >= 0
    }
    named = {at: row for at, row in above.items() if sum(bool(cell) for cell in row) >= 2}
    if given.header_line is not None and given.header_line < len(rows):
        below = [("" if cell is None else str(cell).strip()) for cell in rows[given.header_line]]
        if any(below) and not any(map(_is_value, rows[given.header_line])):
            named[given.header_line] = below
    units: list[str] = []
    for at in sorted(named, reverse=True):
        if len(named) > 1 and all(is_unit(cell) for cell in named[at]) and any(named[at]):
            units = named.pop(at)
            break
    if not named:
        return [], units, 0
    at = max(named, key=lambda k: (sum(column_name(cell).role is not None for cell in named[k] if cell), k))
    return named[at], units, at + 1


def _column(name: str, unit: str, cells: Sequence[Any], decimal: str) -> RawColumn:
    """Convert the cells of a column: numbers stay numbers, dates and times become seconds, others become text."""
    kinds = {type(cell) for cell in cells if cell is not None and cell != ""}
    present = np.array([cell is not None and cell != "" for cell in cells], dtype=np.bool_)
    if kinds and kinds <= {int, float}:
        value = np.array([float(cell) if there else 0.0 for cell, there in zip(cells, present, strict=True)])
        usable = np.isfinite(value)
        return RawColumn(name, Numbers(np.where(usable, value, 0.0), present & usable), unit)
    if kinds == {time}:  # as text, so that a midnight among them is found as in any other table
        return RawColumn(name, [cell.isoformat() if there else "" for cell, there in zip(cells, present, strict=True)])
    if kinds and kinds <= {datetime, date, time, timedelta}:
        seconds = [_seconds(cell) if there else 0.0 for cell, there in zip(cells, present, strict=True)]
        first = next(cell for cell in cells if cell is not None and cell != "")
        start = _seconds(first) if isinstance(first, date) else 0.0
        value = np.where(present, np.array(seconds) - start, 0.0)
        return RawColumn(name, Numbers(value, present), "s", str(first) if start or isinstance(first, date) else "")
    texts = ("" if cell is None else str(cell).strip() for cell in cells)
    if decimal == ",":
        texts = (
            text.replace(".", ",") if isinstance(cell, float) else text for cell, text in zip(cells, texts, strict=True)
        )
    return RawColumn(name, list(texts), unit)


def _seconds(cell: datetime | date | time | timedelta) -> float:
    """Convert a date to seconds since 1900, a time of day to seconds since midnight, or a duration to seconds."""
    if isinstance(cell, datetime):
        return (cell.replace(tzinfo=None) - EPOCH).total_seconds()
    if isinstance(cell, date):
        return (datetime(cell.year, cell.month, cell.day) - EPOCH).total_seconds()
    if isinstance(cell, time):
        return 3600.0 * cell.hour + 60.0 * cell.minute + cell.second + 1e-6 * cell.microsecond
    return cell.total_seconds()

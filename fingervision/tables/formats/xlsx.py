"""Excel workbooks (.xlsx, .xlsm): the values of one sheet; no macro is executed and no formula is computed."""

import zipfile
from collections.abc import Sequence
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from pathlib import Path
from re import findall
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.needed_library import needed_library
from fingervision.tables.dialect import THOUSANDS, is_number, which_mark
from fingervision.tables.mapping import Entry
from fingervision.tables.parts import chosen_part
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.raw_table import RawTable
from fingervision.tables.text_table import table_of_lines
from fingervision.tables.units import column_name

ORDER = 20
MOST_UNPACKED_BYTES = 600_000_000
"""Largest unpacked size: a full sheet (1 048 576 rows) of six columns has about 250 MB of XML, and a much larger
archive is not a measured table but perhaps an archive bomb."""
MOST_SHARED_BYTES = 100_000_000
"""Largest total size of the texts of cells, all of which are kept in memory."""
HEADER_ROWS = 60
"""Number of rows in which a sheet's table is looked for."""


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
    library = needed_library("openpyxl", "formats", f"{path} is an Excel workbook, which", "save the table as CSV")
    _check_archive(path)
    book = library.load_workbook(path, read_only=True, data_only=True, keep_links=False)
    try:
        sheets = {sheet.title: sheet for sheet in book.worksheets}
        names = {
            title: named
            for title, sheet in sheets.items()
            if (named := _names(list(sheet.iter_rows(max_row=HEADER_ROWS, values_only=True))))
        }
        title = chosen_part(path, names, given, "sheet")
        rows = list(sheets[title].iter_rows(values_only=True))
        place = book.sheetnames.index(title)
    finally:
        book.close()
    return _table(path, rows, title, given, _Sheet(path, place, library))


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
    """Whether a cell is a number, a date or a time, or a text that is a number with either decimal mark."""
    if isinstance(cell, str):
        return any(is_number(cell.strip(), mark) for mark in ".,")
    return isinstance(cell, int | float | datetime | date | time | timedelta) and not isinstance(cell, bool)


def _names(rows: Sequence[tuple[Any, ...]]) -> list[str]:
    """Row of a sheet with the most known column names; empty if no row has two values."""
    if not any(sum(map(_is_value, row)) >= 2 for row in rows):
        return []
    texts = [[str(cell).strip() for cell in row if cell is not None] for row in rows]
    return max(texts, key=lambda row: sum(column_name(cell).role is not None for cell in row) if len(row) > 1 else -1)


class _Sheet:
    """Information on a sheet that openpyxl's fast reader omits: merged cells, and formulas without a value."""

    def __init__(self, path: Path, place: int, library: Any) -> None:
        self.path, self._place, self._library = path, place, library

    def merged(self) -> list[tuple[int, int, int, int]]:
        """Return first and last row and column (from 1) of each merged range."""
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
    """Read the rows of a sheet as lines of text with tabs, so that one reader finds header, units and rows."""
    decimal = _decimal_of_texts(path, rows, given)
    wide = max((len(row) for row in rows), default=0)
    lines = ["\t".join(_text(row[k] if k < len(row) else None, decimal) for k in range(wide)) for row in rows]
    words = {**given.words, "separator": "tab", "decimal": decimal}
    raw = table_of_lines(path, lines, replace(given, words=words), "")
    for r0, r1, c0, c1 in sheet.merged():
        named = any(raw.columns[k].name for k in range(c0 - 1, min(c1, len(raw.columns))))
        if len(raw.lines) and r1 >= raw.lines[0] and named and (r1 > r0 or c1 > c0):
            raise DataError(
                f"Sheet '{title}' of {path} must have one cell per value, but rows {r0} to {r1}, columns {c0} to {c1} "
                "are merged into one: unmerge them, so that each row has its own value."
            )
    for k, column in enumerate(raw.columns):
        empty = next((line for line in raw.lines if rows[line - 1][k : k + 1] in ((), (None,))), None)
        if column.name and empty is not None and sheet.formula(empty, k + 1):
            raise DataError(
                f"The cell in row {empty}, column {k + 1} of sheet '{title}' of {path} holds a formula whose value was "
                "never calculated: open the workbook in Excel or LibreOffice, save it, and read it again."
            )
    return replace(
        raw,
        what=f"Excel workbook, sheet '{title}'" + (", without its macros" if path.suffix.lower() == ".xlsm" else ""),
        settings={"part": title, **({"decimal": decimal} if decimal != "." else {})},
    )


def _decimal_of_texts(path: Path, rows: Sequence[Sequence[object]], given: Entry) -> str:
    """Decimal mark of the numbers that are stored as text, as after a paste in another locale; else a point.

    Raises
    ------
    OpenQuestionError
        Each comma may be a decimal mark or separate thousands.
    """
    if "decimal" in given.words:
        return given.words["decimal"]
    commas = [
        text
        for row in rows
        for cell in row
        if isinstance(cell, str) and "," in (text := cell.strip()) and is_number(text, ",")
    ]
    if commas and all(THOUSANDS[","].fullmatch(text) for text in commas):
        raise OpenQuestionError(path, "table", [which_mark(commas)])
    return "," if commas else "."


def _text(cell: Any, decimal: str) -> str:
    """Write a cell as text: numbers in all their digits, dates in ISO 8601, durations in seconds."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell).replace(".", decimal)
    if isinstance(cell, timedelta):
        return f"{cell.total_seconds()!r} s".replace(".", decimal)
    if isinstance(cell, datetime):
        return cell.replace(tzinfo=None).isoformat(sep=" ")
    if isinstance(cell, date | time):
        return cell.isoformat()
    return " ".join(str(cell).split())

"""Tables with a record per row: written line by line, complete whenever the program is stopped, and read again."""

import csv
import io
import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from enum import Enum
from functools import cache
from math import isfinite
from operator import attrgetter
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

from fingervision.domain.errors import OutputError
from fingervision.domain.field import Declared, declared
from fingervision.storage.durable import FLUSH_EVERY_S, flush, flush_open

Row = TypeVar("Row")


class RowFile(Generic[Row]):
    """Appends records to a table; the columns are the record's fields, and None is an empty cell.

    Complete lines are on the disk within a second. If the disk is full, the file is truncated after its last complete
    line.

    Parameters
    ----------
    path : Path
        The file.
    record : type
        Record (a dataclass with declared fields) of which each row is one.
    names : sequence of str, optional
        Columns that are written; all fields of the record by default.
    go_on : bool
        Whether rows are appended to an existing file; otherwise an existing file is replaced.

    Raises
    ------
    FingervisionError
        The file cannot be written; also from `add` and `close`.
    """

    def __init__(self, path: Path, record: type[Row], names: Sequence[str] = (), *, go_on: bool = False) -> None:
        self._path = path
        self._cells = [make for name, make in _cells_of(record) if not names or name in names]
        self._pending: list[str] = []
        try:
            self._file = path.open("ab" if go_on else "wb", buffering=0)
            self._whole_bytes = path.stat().st_size
        except OSError as error:
            raise OutputError(
                f"{path} could not be written ({error.strerror}): name another folder with --out."
            ) from error
        if not go_on:
            self._pending.append(",".join(name for name, _ in _cells_of(record) if not names or name in names))
        self._write()
        with suppress(OSError):  # /dev has no entries to flush
            flush(path.parent)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add(self, rows: Sequence[Row]) -> None:
        """Add rows, in order."""
        self._pending += [",".join([make(row) for make in self._cells]) for row in rows]
        if self._pending and monotonic() - self._written_at >= FLUSH_EVERY_S:
            self._write()

    def close(self) -> None:
        """Write pending rows and close the file; closing twice is allowed."""
        if self._file.closed:
            return
        try:
            self._write()
        finally:
            self._file.close()

    def _write(self) -> None:
        self._written_at = monotonic()
        if not self._pending:
            return
        block = ("\n".join(self._pending) + "\n").encode()
        self._pending.clear()
        written = 0
        try:
            while written < len(block):
                written += os.write(self._file.fileno(), block[written:])
            flush_open(self._file.fileno())
        except OSError as error:
            # An incomplete line is removed.
            self._whole_bytes += block[:written].rfind(b"\n") + 1
            with suppress(OSError):  # a pipe cannot be cut back
                os.ftruncate(self._file.fileno(), self._whole_bytes)
            self._file.close()
            raise OutputError(
                f"{self._path} could not be written any further ({error.strerror}); it holds the rows written before: "
                f"free disk space and measure again."
            ) from error
        self._whole_bytes += len(block)


def _cells_of(record: Any) -> tuple[tuple[str, Callable[[Any], str]], ...]:
    """For each field, its name and the function that makes a row's cell of it."""
    return _cells_of_fields(record)


@cache
def _cells_of_fields(record: Any) -> tuple[tuple[str, Callable[[Any], str]], ...]:
    return tuple((each.name, _cell_of(each)) for each in declared(record))


def _cell_of(each: Declared) -> Callable[[Any], str]:
    value, places = attrgetter(each.name), each.field.places
    if each.kind is float:
        return lambda row: cell(value(row), places)
    if each.kind is str:
        return lambda row: quoted(value(row))
    if isinstance(each.kind, type) and issubclass(each.kind, Enum):
        return lambda row: str(value(row).value)
    return lambda row: str(value(row))


def line_of(row: Any) -> str:
    """Write a record as a line, without its end."""
    return ",".join(make(row) for _, make in _cells_of(type(row)))


def row_of(record: type[Row], names: Sequence[str], cells: Sequence[str]) -> Row:
    """Read a record from the cells of a line; an empty cell is a missing value.

    Raises
    ------
    ValueError, TypeError
        A cell is not a value of its field, or a required one is missing.
    """
    stated = dict(zip(names, cells, strict=True))
    known = {each.name: each.kind(stated[each.name]) for each in declared(record) if stated.get(each.name)}
    empty = {
        each.name: None if each.is_optional else ""
        for each in declared(record)
        if each.is_required and (each.is_optional or each.kind is str)
    }
    return record(**{**empty, **known})


def cell(value: float | None, places: int | None) -> str:
    """Format a number without trailing zeros, or with nine digits if no places are given; None is an empty string."""
    if value is None:
        return ""
    return f"{value:z.9g}" if places is None else f"{value:z.{places}f}".rstrip("0").rstrip(".")


def quoted(text: str) -> str:
    """Quote text for CSV (RFC 4180)."""
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\n\r') else text


def table_text(header: Sequence[str], rows: Iterable[Sequence[object]], comment: str = "", digits: int = 9) -> str:
    """Text of a table below a comment; numbers with significant digits; None and what is not finite are empty cells."""
    text = io.StringIO()
    text.write(f"# {comment}\n" if comment else "")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([_shown(value, digits) for value in row] for row in rows)
    return text.getvalue()


def _shown(value: object, digits: int) -> object:
    if isinstance(value, float):
        return f"{value:z.{digits}g}" if isfinite(value) else ""
    return "" if value is None else value


def write_table(
    path: Path, header: Sequence[str], rows: Iterable[Sequence[object]], comment: str = "", digits: int = 9
) -> None:
    """Write a table at once; see `table_text`."""
    path.write_text(table_text(header, rows, comment, digits), encoding="utf-8", newline="\n")

"""Reader of gaps.csv, also while the file is still being written."""

import csv
import os
from dataclasses import fields
from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.domain.status import Status
from fingervision.storage.gaps_csv import GapRow

_NUMBERS = frozenset(each.name for each in fields(GapRow)) - {"frame", "status", "fingers", "run"}


class GapsReader:
    """Reads the complete lines of a gaps.csv that is still growing.

    Parameters
    ----------
    path : Path
        The file gaps.csv, which need not exist yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: list[GapRow] = []
        """The rows of the file so far, in a new list after each change."""
        self._columns: tuple[str, ...] = ()
        self._place, self._last_line = 0, b""
        self._file: tuple[int, int] | None = None

    def refresh(self) -> bool:
        """Read the rows that were added to the file; return True if the file was replaced, and all rows are new.

        A file is another one if the operating system numbers it differently, or if it no longer has, at the same
        place, the line that was read last.

        Raises
        ------
        OSError
            The table exists but cannot be read.
        DataError
            A line has not as many cells as the header.
        """
        try:
            with self.path.open("rb") as file:
                status = os.fstat(file.fileno())
                identity = status.st_dev, status.st_ino
                file.seek(self._place - len(self._last_line))
                # Until its header is written, a file has nothing that could have been read of it.
                is_same = (
                    self._place > 0 and identity == self._file and file.read(len(self._last_line)) == self._last_line
                )
                if not is_same:
                    file.seek(0)
                text = file.read()
        except FileNotFoundError:
            return False
        is_replaced = not is_same and self._place > 0
        whole = text[: text.rfind(b"\n") + 1]
        lines = whole.splitlines(keepends=True)
        table = list(csv.reader(line.decode("utf-8") for line in lines))
        columns = self._columns if is_same else tuple(table.pop(0) if table else ())
        rows = [self._row(columns, cells) for cells in table]
        if is_same and not rows:
            return False
        self.rows = self.rows + rows if is_same else rows
        self._file, self._columns = identity, columns
        self._place = len(whole) + (self._place if is_same else 0)
        self._last_line = lines[-1] if lines else b""
        return is_replaced

    def _row(self, columns: tuple[str, ...], line: list[str]) -> GapRow:
        if len(line) != len(columns):
            raise DataError(
                f"Each line of {self.path} must have {len(columns)} cells, as its header, but one has {len(line)}: "
                "measure the recording again."
            )
        cells = dict(zip(columns, line, strict=True))
        numbers = {name: float(cell) for name, cell in cells.items() if name in _NUMBERS and cell}
        return GapRow(
            frame=int(cells["frame"]),
            status=Status(cells["status"]),
            fingers=cells.get("fingers", ""),
            run=cells.get("run", ""),
            **{"time_s": None, **numbers},
        )

"""Measured rows of the last minutes, in a fixed amount of memory."""

from collections.abc import Iterator
from dataclasses import astuple, replace
from threading import Lock
from typing import Any

import numpy as np

from fingervision.domain.status import Status
from fingervision.storage.gaps_csv import GapRow

# Number of rows: ten minutes at 25 frames per second.
ROWS_KEPT = 15_000
STATUSES = tuple(Status)
# Columns of a row: frame, time_s, status and thirteen numbers; two further columns hold input and force.
COLUMNS_KEPT = 16


class History:
    """Ring buffer of measured rows.

    Parameters
    ----------
    kept : int
        Number of rows that are kept.
    """

    def __init__(self, kept: int = ROWS_KEPT) -> None:
        # Filling the array makes the operating system allocate its memory now. NaN represents an empty cell, only here.
        self._cells = np.full((kept, COLUMNS_KEPT + 2), np.nan)
        self.count = 0
        self._lock = Lock()

    def add(self, row: GapRow) -> None:
        """Add a row; if the buffer is full, the oldest row is dropped."""
        cells = [*astuple(row)[:COLUMNS_KEPT], row.input_mm, row.force_n]
        cells[2] = STATUSES.index(row.status)
        with self._lock:
            self._cells[self.count % len(self._cells)] = [np.nan if cell is None else cell for cell in cells]
            self.count += 1

    @property
    def oldest(self) -> int:
        """Number of the oldest row in the buffer, counted from the first row of the measurement."""
        return max(0, self.count - len(self._cells))

    def rows(self, after: int = 0, before: int | None = None) -> Iterator[GapRow]:
        """Rows in the buffer with numbers from `after` to `before` - 1, counted since the start of the measurement."""
        with self._lock:
            last = self.count if before is None else min(before, self.count)
            asked = np.arange(max(after, self.count - len(self._cells)), last)
            kept = self._cells[asked % len(self._cells)].tolist()
        for frame, time_s, status, *numbers in kept:
            cells: list[Any] = [None if cell != cell else cell for cell in (time_s, *numbers)]
            row = GapRow(int(frame), cells[0], STATUSES[int(status)], *cells[1:-2])
            yield row if cells[-2] is None else replace(row, input_mm=cells[-2], force_n=cells[-1])

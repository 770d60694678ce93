"""The last minutes of the gap, in a fixed amount of memory."""

from collections.abc import Iterator
from dataclasses import astuple, replace
from threading import Lock
from typing import Any

import numpy as np

from fingervision.domain.status import Status
from fingervision.storage.gaps_csv import GapRow

# Ten minutes at 25 frames a second.
ROWS_KEPT = 15_000
STATUSES = tuple(Status)
# frame, time_s, status and thirteen numbers; behind them input and force.
COLUMNS_KEPT = 16


class History:
    """A ring buffer of rows.

    Parameters
    ----------
    kept : int
        Rows that are kept.
    """

    def __init__(self, kept: int = ROWS_KEPT) -> None:
        # Filled, so that its memory is taken now and not while it fills. NaN is an empty cell, in memory alone.
        self._cells = np.full((kept, COLUMNS_KEPT + 2), np.nan)
        self.count = 0
        self._lock = Lock()

    def add(self, row: GapRow) -> None:
        """Add a row; the oldest is dropped."""
        cells = [*astuple(row)[:COLUMNS_KEPT], row.input_mm, row.force_n]
        cells[2] = STATUSES.index(row.status)
        with self._lock:
            self._cells[self.count % len(self._cells)] = [np.nan if cell is None else cell for cell in cells]
            self.count += 1

    @property
    def oldest(self) -> int:
        """Number of the oldest kept row, counted from the first row ever."""
        return max(0, self.count - len(self._cells))

    def rows(self, after: int = 0, before: int | None = None) -> Iterator[GapRow]:
        """Kept rows with numbers from `after` up to but excluding `before`, counted from the first row ever."""
        with self._lock:
            last = self.count if before is None else min(before, self.count)
            asked = np.arange(max(after, self.count - len(self._cells)), last)
            kept = self._cells[asked % len(self._cells)].tolist()
        for frame, time_s, status, *numbers in kept:
            cells: list[Any] = [None if cell != cell else cell for cell in (time_s, *numbers)]
            row = GapRow(int(frame), cells[0], STATUSES[int(status)], *cells[1:-2])
            yield row if cells[-2] is None else replace(row, input_mm=cells[-2], force_n=cells[-1])

"""Columns of numbers in a table, with a mask of empty cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.csv_columns import number
from fingervision.storage.decimal_number import are_decimal, decimal_number


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """One column of numbers.

    Parameters
    ----------
    value : ndarray of float, shape (n,)
        Finite numbers; 0 for an empty cell.
    present : ndarray of bool, shape (n,)
        Whether the cell holds a number.
    """

    value: NDArray[np.float64]
    present: NDArray[np.bool_]

    @classmethod
    def whole(cls, value: NDArray[np.float64]) -> "Numbers":
        """Make a column from values without empty cells."""
        return cls(value, np.ones(value.size, dtype=np.bool_))

    @property
    def complete(self) -> bool:
        """Whether the column has no empty cell."""
        return bool(self.present.all())


def numbers_in(path: Path, name: str, cells: Sequence[str]) -> Numbers:
    """Read cells as finite numbers; an empty cell represents a missing value.

    Raises
    ------
    DataError
        A cell is not a finite number; the message names the first such cell and its data row.
    """
    try:
        read = float if are_decimal(cells) else decimal_number
        value = np.array(list(map(read, cells)), dtype=np.float64)
        present = np.ones(value.size, dtype=np.bool_)
    except ValueError:
        present = np.array([bool(cell) for cell in cells], dtype=np.bool_)
        try:
            value = np.array([decimal_number(cell) if cell else 0.0 for cell in cells], dtype=np.float64)
        except ValueError:
            value = np.full(len(cells), np.nan)
    if not np.all(np.isfinite(value)):
        for row, cell in enumerate(cells):
            number(path, name, row, cell)
    return Numbers(value, present)

"""Columns of numbers in a table, with a mask of empty cells, and the notation of numbers in own files."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError

FEWEST_LINES = 2000
"""Smallest number of lines for the fast method; reading fewer lines cell by cell takes less than 20 ms."""


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


def numbers_in(path: Path, name: str, cells: Sequence[str], lines: Sequence[int] = ()) -> Numbers:
    """Read cells as finite numbers; an empty cell represents a missing value.

    Parameters
    ----------
    path : Path
        File of the cells, for error messages.
    name : str
        Name of the column.
    cells : sequence of str, length n
        The cells.
    lines : sequence of int, length n, optional
        Line of each cell; the number of its row by default.

    Raises
    ------
    DataError
        A cell is not a finite number; the message names the first such cell and its line.
    """
    try:
        read = float if are_decimal(cells) else decimal_number
        value = np.array(list(map(read, cells)), dtype=np.float64)
        present = np.ones(value.size, dtype=np.bool_)
    except ValueError:
        present = np.array([bool(cell) for cell in cells], dtype=np.bool_)
        value = np.array([_number(cell) for cell in cells], dtype=np.float64)
    wrong = np.flatnonzero(~np.isfinite(value))
    if wrong.size:
        at = int(wrong[0])
        where = f"line {lines[at]}" if len(lines) else f"data row {at + 1}"
        raise DataError(
            f"{name} must be a finite number, but is '{cells[at]}' in {where} of {path}: correct it, or leave the cell "
            "empty."
        )
    return Numbers(value, present)


def _number(cell: str) -> float:
    """Number in a cell: 0 if it is empty, and not finite if it holds no number."""
    try:
        return decimal_number(cell) if cell else 0.0
    except ValueError:
        return float("nan")


def decimal_number(cell: str) -> float:
    """Read a decimal number written in ASCII characters.

    Python's own conversion would also accept 1_0 as 10, and digits of other scripts.

    Raises
    ------
    ValueError
        The cell is not a decimal number in a notation that tables use.

    Examples
    --------
    >>> decimal_number(" -1.5e-3 ")
    -0.0015
    >>> decimal_number("1_0")
    Traceback (most recent call last):
    ...
    ValueError: 1_0 is not a decimal number
    """
    if not are_decimal((cell,)):
        raise ValueError(f"{cell} is not a decimal number")
    return float(cell)


def are_decimal(cells: Iterable[str]) -> bool:
    """Whether cells that Python can convert to numbers are also decimal numbers in a notation used in tables."""
    joined = "".join(cells)
    return "_" not in joined and joined.isascii()


def is_number(value: object) -> bool:
    """Whether a value of a document is an integer or floating-point number that a float can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return isfinite(value)
    except OverflowError:
        return False


def number_block(lines: Sequence[str], separator: str | None, wide: int) -> NDArray[np.float64] | None:
    """Read lines of numbers in one call; None if each cell must be read separately.

    Parameters
    ----------
    lines : sequence of str
        Rows of the table, without a header.
    separator : str or None
        Separator between two cells; None for any white space.
    wide : int
        Number of cells in a row.

    Returns
    -------
    ndarray of float, shape (n, wide), or None
        Numbers of the table; None if there are fewer rows than `FEWEST_LINES`, if a cell is empty or not a finite
        number, or if rows differ in length.
    """
    if len(lines) < FEWEST_LINES:
        return None
    try:
        block = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2, dtype=np.float64)
    except ValueError:
        return None
    # If blank lines were skipped, the following rows would get wrong line numbers.
    if block.shape != (len(lines), wide) or not np.all(np.isfinite(block)):
        return None
    return block

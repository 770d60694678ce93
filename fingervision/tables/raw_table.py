"""A table as stored in a file, before its columns are interpreted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import Numbers


@dataclass(frozen=True, slots=True, eq=False)
class RawColumn:
    """One column of a raw table.

    Parameters
    ----------
    name : str
        Name as in the file, including a unit that the name contains.
    content : sequence of str, or Numbers
        Cells as text, or as numbers if the file format stores numbers.
    unit : str
        Unit that is stated separately from the name, in a row of units or as a property of the channel; empty if there
        is none.
    since : str
        For seconds that were converted from dates: the first date, as text; empty for any other column.
    """

    name: str
    content: Sequence[str] | Numbers
    unit: str = ""
    since: str = ""

    def __len__(self) -> int:
        return self.content.value.size if isinstance(self.content, Numbers) else len(self.content)

    def words(self) -> tuple[str, ...]:
        """Return the cells as texts, such as names of runs; empty where a number is missing."""
        if not isinstance(self.content, Numbers):
            return tuple(cell.strip() for cell in self.content)
        pairs = zip(self.content.value, self.content.present, strict=True)
        return tuple(f"{value:g}" if there else "" for value, there in pairs)


MOST_COLUMNS = 4096
"""Columns of a table: loggers write at most some hundreds; interpreting a column takes about 0.2 ms, and a table of 100
000 columns took minutes."""


def check_columns(path: Path, count: int) -> None:
    """Refuse a table with too many columns before the columns' names are interpreted.

    Raises
    ------
    DataError
        The table has more than `MOST_COLUMNS` columns.
    """
    if count > MOST_COLUMNS:
        raise DataError(
            f"{path} must have at most {MOST_COLUMNS} columns, but has {count}: export the columns that are needed, or "
            "exchange rows and columns."
        )


@dataclass(frozen=True, slots=True, eq=False)
class RawTable:
    """All columns of one table, with equal length.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        Description of file format and dialect.
    columns : tuple of RawColumn
        Columns in the order of the file.
    lines : sequence of int
        Line number (or row of the sheet) of each row; empty for a format without lines.
    left_out : tuple of str
        Omissions with their reasons, one sentence each.
    notes : tuple of str
        Assumptions that were made, one sentence each.
    restarts : ndarray of int
        Indices of the rows before which the header was repeated.
    settings : mapping of str to str
        Keys of columns.toml with which the file would be read in the same way.
    named : bool
        Whether the file itself names its columns.
    """

    path: Path
    what: str
    columns: tuple[RawColumn, ...]
    lines: Sequence[int] = ()
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    restarts: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    settings: Mapping[str, str | int] = field(default_factory=dict)
    named: bool = True

    @property
    def rows(self) -> int:
        """Number of rows in the table."""
        return len(self.columns[0]) if self.columns else 0

    def place(self, row: int) -> str:
        """Location of a row in the file, for messages."""
        return f"line {self.lines[row]}" if len(self.lines) else f"row {row + 1}"

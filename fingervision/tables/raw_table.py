"""A table as stored in a file, before its columns are interpreted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.number_columns import Numbers


@dataclass(frozen=True, slots=True, eq=False)
class RawColumn:
    """One column.

    Parameters
    ----------
    name : str
        As in the file, with what it says of its unit.
    content : sequence of str, or Numbers
        Cells as text; or as numbers where the format holds such.
    unit : str
        Unit that is stated apart from the name: a row of units, a property of the channel. Empty: none.
    since : str
        For seconds that were dates: the date of the first, as text. Empty: no dates.
    """

    name: str
    content: Sequence[str] | Numbers
    unit: str = ""
    since: str = ""

    def __len__(self) -> int:
        return self.content.value.size if isinstance(self.content, Numbers) else len(self.content)


@dataclass(frozen=True, slots=True, eq=False)
class RawTable:
    """All columns of one table, with equal length.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        Format and dialect in words.
    columns : tuple of RawColumn
        In the file's order.
    lines : sequence of int
        Line (or row of the sheet) of each row; empty where a format has none.
    left_out : tuple of str
        What was left out and why, a sentence each.
    notes : tuple of str
        What was assumed, a sentence each.
    restarts : ndarray of int
        Rows before which the header stood again.
    settings : mapping of str to str
        Keys of columns.toml that would read it the same way again.
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
        """Number of rows."""
        return len(self.columns[0]) if self.columns else 0

    def place(self, row: int) -> str:
        """Location of a row in the file."""
        return f"line {self.lines[row]}" if len(self.lines) else f"row {row + 1}"

"""Header of a text table (names and units of the columns), and headers with a label before each value."""

from collections.abc import Sequence
from dataclasses import dataclass

from fingervision.tables.dialect import Dialect, split
from fingervision.tables.units import known_unit

NAME, UNIT = "name", "unit"
CLOCK = "Time"
"""Name of the column of times before each channel."""


@dataclass(frozen=True, slots=True)
class Header:
    """The header lines above the numbers.

    Parameters
    ----------
    names : tuple of str
        Names of the columns; empty if there are none.
    units : tuple of str
        Units from a row of units; empty if there is none.
    line : int
        Number of the line with the names, from 0; -1 if there is none.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    line: int = -1


def labelled_pairs(lines: Sequence[str], dialect: Dialect) -> Header | None:
    """Read a header in which a label stands above each column of times, and its value above the column of the channel.

    Beckhoff's TwinCAT Scope exports `Name  ActPos  Name  Gap` and `Unit  mm  Unit  mm` above pairs of time and value.
    The unit of the times is not stated there.

    Parameters
    ----------
    lines : sequence of str
        Lines above the first row.
    dialect : Dialect
        Separator and number of columns.

    Returns
    -------
    Header or None
        None if no line has pairs of label and value.
    """
    if dialect.wide < 4 or dialect.wide % 2:
        return None
    found: dict[str, tuple[int, list[str]]] = {}
    for at, line in enumerate(lines):
        cells = split(line, dialect.separator)
        cells += [""] * (dialect.wide - len(cells))
        labels = {cell.lower() for cell in cells[::2]}
        if len(cells) == dialect.wide and len(labels) == 1:
            found[labels.pop()] = at, cells[1::2]
    if NAME not in found:
        return None
    line_number, channels = found[NAME]
    units = [unit if known_unit(unit) else "" for unit in found.get(UNIT, (0, [""] * len(channels)))[1]]
    names = tuple(name for channel in channels for name in (CLOCK, channel))
    return Header(names, tuple(name for unit in units for name in ("", unit)), line_number)

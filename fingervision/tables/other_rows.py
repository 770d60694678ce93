"""Lines among the rows of a text table that are no rows: the column names of a second table, and statistics."""

from collections.abc import Sequence

from fingervision.tables.column_names import column_name
from fingervision.tables.dialect import is_value
from fingervision.tables.questions import Question
from fingervision.tables.units import is_unit, known_unit, spelled
from fingervision.tables.words import tokens

AVERAGE_WORDS = (
    "mean average avg stdev stddev std sd variance rms mittelwert mittel standardabweichung stabw moyenne ecarttype "
    "promedio media deviazione"
)
OTHER_WORDS = "min max minimum maximum sum total median count range n summe anzahl spanne"
AVERAGES = frozenset(AVERAGE_WORDS.split())
"""Words for statistics that mark a row wherever they stand. The others may be remarks on a measured row."""
STATISTICS = AVERAGES | frozenset(OTHER_WORDS.split())


def is_other_header(cells: Sequence[str], names: Sequence[str], units: Sequence[str], decimal: str) -> bool:
    """Whether a line among the rows begins a table with other columns, or with the same columns in other units.

    Examples
    --------
    >>> names = ["Time (s)", "Position (mm)"]
    >>> is_other_header(["Time (s)", "Position (um)"], names, ["", ""], ".")
    True
    >>> is_other_header(["TIME (s)", "position [mm]"], names, ["", ""], ".")
    False
    """
    cells = [cell.strip() for cell in cells]
    if any(cell and is_value(cell, decimal) for cell in cells) or sum(map(bool, cells)) < 2:
        return False
    if any(units) and all(is_unit(cell) for cell in cells):
        return any(known_unit(a) != known_unit(b) for a, b in zip(cells, units, strict=True))
    here, above = ([column_name(cell) for cell in line] for line in (cells, names))
    roles = [name.role for name in here]
    if sum(role is not None for role in roles) < 2:
        return False
    return any(
        a.role != b.role or _unit(a.unit) != _unit(b.unit) for a, b in zip(here, above, strict=True) if a.text != b.text
    )


def _unit(text: str) -> str:
    return known_unit(text) or spelled(text)


def other_header(first: int, other: int) -> Question:
    """Question which of two tables in one file is to be read; `first` and `other` are the lines of their names."""
    return Question(
        f"line {other} has other column names or units than line {first}, so that the file holds more than one table: "
        f"header_line={first} or header_line={other} reads one of them",
        f"header_line={first}",
    )


def statistics_below(rows: Sequence[Sequence[str]]) -> int:
    """Number of rows at the end of a table that hold statistics of the rows above, such as their mean.

    Examples
    --------
    >>> statistics_below([["0.1", "0.6", ""], ["0.2", "0.7", "max"], ["Mean", "0.65", ""], ["Std. dev.", "0.05", ""]])
    2
    """
    count = 0
    while count < len(rows) and _is_statistics(rows[-1 - count]):
        count += 1
    return count


def _is_statistics(row: Sequence[str]) -> bool:
    words = ["".join(tokens(cell)) for cell in row]
    return words[0] in STATISTICS or any(word in AVERAGES for word in words)

"""Choose the column that a question to the user suggests for a role: by name, unit and values."""

from collections.abc import Sequence

import numpy as np

from fingervision.storage.number_columns import Numbers
from fingervision.tables.cells import to_numbers
from fingervision.tables.column_names import DIMENSION, ColumnName
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.times import looks_like_time
from fingervision.tables.units import factor, known_unit, spelled
from fingervision.tables.words import mentions, tokens

LOOKED_AT = 200
"""Number of cells of a column that are examined: enough to distinguish a clock or a counter from a position."""
BY_NAME, BY_UNIT, BY_CLOCK, BY_READING = 4, 3, 3, 1
"""Points for a word of the role in the name, a unit of its dimension, times that increase, and a word that
distinguishes a reading from a command. A suggestion is only an example in a question; the user decides."""
NEVER = -100
"""Points of a column without numbers, which is not suggested."""
READINGS = frozenset(
    [
        "actual",
        "encoder",
        "feedback",
        "measured",
        "readback",
        "ist",
        "gemessen",
        "mesure",
        "mesuree",
        "medido",
        "misurata",
    ]
)
"""Words that denote a measured position, and not a command."""


def likeliest(
    raw: RawTable, names: Sequence[ColumnName], role: str, candidates: Sequence[int], decimal: str
) -> int | None:
    """Find the most probable column for a role; None if no column is possible.

    Parameters
    ----------
    raw : RawTable
        The table.
    names : sequence of ColumnName
        Names of its columns.
    role : str
        `time`, `input`, `gap` and so on.
    candidates : sequence of int
        Numbers of the columns that have no role yet.
    decimal : str
        Decimal mark of cells that are still text.

    Returns
    -------
    int or None
        Number of the column, from 0.
    """
    points = {k: _points(raw.columns[k], names[k], role, decimal) for k in candidates}
    best = max(candidates, key=lambda k: points[k], default=None)
    # If a file has no names and units, the columns are suggested in their order.
    return best if best is not None and points[best] >= 0 else None


def _points(column: RawColumn, name: ColumnName, role: str, decimal: str) -> int:
    if role in DIMENSION and not _has_values(column, decimal):
        return NEVER
    found = mentions(name.base)
    constant = _is_constant(column)
    points = BY_NAME if role in found else -BY_NAME if found else 0
    unit = spelled(column.unit) or name.unit
    if known_unit(unit) is not None:
        points += BY_UNIT if factor(unit, DIMENSION.get(role, "length")) is not None else -2 * BY_UNIT
    points += BY_READING * (role == "input" and bool(READINGS & set(tokens(name.base))))
    points -= BY_READING * (role == "input" and "target" in found) + BY_READING * constant
    is_clock = increases(column, decimal)
    if role == "time":
        return points + (BY_CLOCK if is_clock else -2 * BY_CLOCK)
    return points - (BY_READING if is_clock else 0)


def _has_values(column: RawColumn, decimal: str) -> bool:
    """Whether most of a column's first cells are numbers or times; names of channels and remarks are neither."""
    content = column.content
    if isinstance(content, Numbers):
        return bool(content.present.any())
    if looks_like_time(content):
        return True
    numbers, odd = to_numbers(content[:LOOKED_AT], decimal)
    return int(np.count_nonzero(numbers.present)) > odd.size


def _is_constant(column: RawColumn) -> bool:
    content = column.content
    if isinstance(content, Numbers):
        return bool(np.ptp(content.value[:LOOKED_AT]) == 0.0) if content.value.size else True
    return len(set(content[:LOOKED_AT])) < 2


def increases(column: RawColumn, decimal: str) -> bool:
    """Whether a column's first values increase by equal steps, or are dates."""
    content = column.content
    if isinstance(content, Numbers):
        values = content.value[:LOOKED_AT][content.present[:LOOKED_AT]]
    else:
        if looks_like_time(content):
            return True
        numbers, _ = to_numbers(content[:LOOKED_AT], decimal)
        values = numbers.value[numbers.present]
    steps = np.diff(values)
    return bool(steps.size and np.all(steps > 0.0) and np.ptp(steps) <= 0.5 * float(np.median(steps)))

"""Choose the column that a question to the user suggests for a role: by name, unit and values."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.csv_columns import Numbers
from fingervision.tables.dialect import to_numbers
from fingervision.tables.questions import span
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.times import looks_like_time
from fingervision.tables.units import CANONICAL, DIMENSION, ColumnName, factor, known_unit, spelled
from fingervision.tables.words import mentions, tokens

LOOKED_AT = 200
"""Number of cells of a column that are examined: enough to distinguish a clock or a counter from a position."""
BY_NAME, BY_UNIT, BY_CLOCK, BY_READING, BY_LAG = 4, 3, 3, 1, 2
"""Points for a word of the role in the name, a unit of its dimension, times that increase, and a word that
distinguishes a reading from a command; and for following another column. Only the order of the readings in a question
depends on them; the user decides."""
SURE = 20.0
"""Least ratio of the motion of a column to that of another with which the other is considered as at rest."""
MOST_BEHIND = 12
"""Largest delay, in rows, between a set-point and the position that follows it."""
SAME_MOTION = 0.1
"""Largest difference of two columns of one motion, as a share of the range."""
NEVER = -100
"""Points of a column without numbers, of one with a unit of another dimension, and of times for any role but the time;
such columns are not suggested."""
READINGS = frozenset(
    [
        "actual",
        "current",
        "enc",
        "encoder",
        "get",
        "pv",
        "rbv",
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


def ranked(raw: RawTable, names: Sequence[ColumnName], role: str, candidates: Sequence[int], decimal: str) -> list[int]:
    """Sort the possible columns of a role, the most probable first.

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
    """
    points = {k: float(_points(raw.columns[k], names[k], role, decimal)) for k in candidates}
    possible = [k for k in candidates if points[k] > -BY_UNIT] or [k for k in candidates if points[k] > NEVER / 2]
    if role == "input":
        values = {k: values_of(raw.columns[k], decimal) for k in possible}
        widest = max((float(np.ptp(values[k])) for k in possible if values[k].size), default=0.0)
        for k in possible:
            points[k] += BY_LAG * sum(np.sign(rows_behind(values[k], values[j])) for j in possible if j != k)
            points[k] -= (BY_NAME + BY_READING) * (values[k].size == 0 or float(np.ptp(values[k])) * SURE < widest)
    # If a file has no names and units, the columns are suggested in their order.
    return sorted(possible, key=lambda k: -points[k])


def values_of(column: RawColumn, decimal: str) -> NDArray[np.float64]:
    """Numbers of a column in the unit of the file, without missing ones; none for dates."""
    content = column.content
    if not isinstance(content, Numbers):
        if looks_like_time(content):
            return np.zeros(0)
        content = to_numbers(content, decimal)[0]
    return content.value[content.present]


def range_of(column: RawColumn, name: ColumnName, decimal: str) -> str:
    """Range of a column in words, in mm, s or N if its unit is known."""
    values, unit = values_of(column, decimal), spelled(column.unit) or name.unit
    for dimension, target in CANONICAL.items():
        if unit and (size := factor(unit, dimension)) is not None:
            return span(values * size, target)
    if not values.size and not isinstance(column.content, Numbers) and looks_like_time(column.content):
        return f"{column.content[0]} to {column.content[-1]}"
    return span(values, unit)


def rows_behind(follower: NDArray[np.float64], leader: NDArray[np.float64]) -> int:
    """Number of rows by which a column follows another one; 0 if it does not, or without a delay.

    A position follows its set-point: shifted by some rows, the two differ by little against their range.
    """
    size = follower.size
    reach = min(MOST_BEHIND, size // 4)
    moved = float(np.ptp(leader)) if leader.size else 0.0
    if size != leader.size or reach < 1 or not moved:
        return 0

    def apart(shift: int) -> float:
        late, early = follower[reach + shift : size - reach + shift], leader[reach : size - reach]
        return float(np.std(late - early))

    shifts = range(-reach, reach + 1)
    found = [apart(shift) for shift in shifts]
    best = int(np.argmin(found))
    is_same_motion = found[best] < SAME_MOTION * moved and found[best] < 0.5 * found[reach]
    return shifts[best] if is_same_motion else 0


def _points(column: RawColumn, name: ColumnName, role: str, decimal: str) -> int:
    if role in DIMENSION and not _has_values(column, decimal):
        return NEVER
    found = mentions(name.base)
    points = BY_NAME if role in found else -BY_NAME if found else 0
    unit = spelled(column.unit) or name.unit
    values = values_of(column, decimal)[:LOOKED_AT]
    is_constant = values.size > 0 and bool(np.ptp(values) == 0.0)
    is_time = "time" in found - {role} or factor(unit, "time") is not None or not values.size
    if role in DIMENSION and role != "time" and is_time:
        return NEVER
    is_sized = unit != "" and factor(unit, DIMENSION.get(role, "length")) is not None
    if not is_sized and known_unit(unit) is not None:
        return NEVER
    points += BY_UNIT * is_sized
    points += BY_READING * (role == "input" and bool(READINGS & set(tokens(name.base))))
    points -= BY_READING * (role == "input" and "target" in found) + BY_READING * is_constant
    is_clock = increases(column, decimal)
    if role == "time":
        return points + (BY_CLOCK if is_clock else -2 * BY_CLOCK)
    return points - (BY_READING if is_clock and not is_sized else 0)


def _has_values(column: RawColumn, decimal: str) -> bool:
    """Whether most of a column's first cells are numbers or times; names of channels and remarks are neither."""
    content = column.content
    if isinstance(content, Numbers):
        return bool(content.present.any())
    if looks_like_time(content):
        return True
    numbers, odd = to_numbers(content[:LOOKED_AT], decimal)
    return int(np.count_nonzero(numbers.present)) > odd.size


def increases(column: RawColumn, decimal: str) -> bool:
    """Whether a column's first values increase by equal steps, or are dates."""
    if not isinstance(column.content, Numbers) and looks_like_time(column.content):
        return True
    steps = np.diff(values_of(column, decimal)[:LOOKED_AT])
    return bool(steps.size and np.all(steps > 0.0) and np.ptp(steps) <= 0.5 * float(np.median(steps)))

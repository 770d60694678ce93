"""Read cells that contain a number and its unit, such as the durations of MATLAB's timetables (`0.1 sec`)."""

import re
from dataclasses import replace

from fingervision.storage.number_columns import Numbers
from fingervision.tables.dialect import MISSING
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.units import known_unit

WITH_UNIT = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*([^\W\d_]+)")


def with_units_of_cells(raw: RawTable) -> RawTable:
    """Move the unit from the cells of a column to the column's name, if all cells have the same unit."""
    columns = tuple(_column(column) for column in raw.columns)
    return raw if columns == raw.columns else replace(raw, columns=columns)


def _column(column: RawColumn) -> RawColumn:
    if isinstance(column.content, Numbers) or column.unit:
        return column
    found: list[str] = []
    units: set[str] = set()
    for cell in column.content:
        match = WITH_UNIT.fullmatch(cell)
        if match is not None and known_unit(match[2]) is not None:
            found.append(match[1])
            units.add(match[2])
        elif cell.lower() in MISSING:
            found.append(cell)
        else:
            return column
        if len(units) > 1:
            return column
    return replace(column, content=found, unit=units.pop()) if units else column

"""Read tables in memory: a pandas DataFrame, a mapping of columns, or the rows of a measurement."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ArgumentError, ArgumentTypeError
from fingervision.domain.measured_table import ONE_CLOCK, MeasuredTable
from fingervision.frames.array_levels import what_it_is
from fingervision.models.table import TableModel
from fingervision.storage import drive_csv, measured_table, simulation_table
from fingervision.storage.csv_columns import Numbers

DRIVE_COLUMNS = ("time_s", "input_mm")
GAP_COLUMNS = ("input_mm", "gap_mm")


def drive_from_columns(table: Any) -> DriveHistory:
    """Read columns `time_s,input_mm[,run][,force_n]` as a drive.

    Raises
    ------
    ArgumentTypeError
        The argument has no columns.
    ArgumentError
        A column is missing, or a cell is not a number.
    DataError
        Times do not increase, or the rows of a run are not contiguous.
    """
    columns = columns_of("drive", table, "a drive table's file name, DriveHistory, DataFrame or mapping of columns")
    values = _values("drive", columns, DRIVE_COLUMNS, drive_csv.COLUMNS)
    for name, numbers in values.items():
        if not numbers.present.all():
            raise ArgumentError("drive", f"have a number in every row of {name}", "has none in some")
    runs = tuple(str(run) for run in columns["run"]) if "run" in columns else None
    rows = range(values["time_s"].value.size)
    return drive_csv.drive_rows(Path("drive"), {name: each.value for name, each in values.items()}, runs, rows)


def measured_from_columns(table: Any) -> MeasuredTable:
    """Read columns `input_mm,gap_mm[,run,time_s,left_mm,right_mm,...]` as a measured table.

    Raises
    ------
    ArgumentTypeError
        The argument has no columns.
    ArgumentError
        A column is missing, or a cell is not a number.
    DataError
        For the same reasons as in `fingervision.read_table`.
    """
    columns = columns_of(
        "measured", table, "a table's file name, Measurement, MeasuredTable, DataFrame or mapping of columns"
    )
    values = _values("measured", columns, GAP_COLUMNS, measured_table.NUMBERS)
    runs = ["" if _is_missing(run) else str(run) for run in columns["run"]] if "run" in columns else None
    table_in_memory = measured_table.measured_rows(Path("measured"), values, runs)
    # A columns.toml in the current folder does not apply to columns in memory.
    return replace(table_in_memory, slots=(), clock=ONE_CLOCK, stamp_s=0.0)


def simulation_from_columns(columns: Mapping[str, list[Any]]) -> TableModel:
    """Read columns `input_mm,gap_mm[,left_mm,right_mm,force_n]` as a simulation table.

    Raises
    ------
    ArgumentError
        A column is missing, or a cell is not a number.
    DataError
        There are fewer than two rows, an input occurs twice, or the gap does not depend on the input.
    """
    names = (*GAP_COLUMNS, "left_mm", "right_mm", "force_n")
    return simulation_table.simulation_rows(Path("simulation"), _values("model", columns, GAP_COLUMNS, names))


def columns_of(argument: str, table: Any, must: str) -> dict[str, list[Any]]:
    """Return the columns of a DataFrame or mapping as lists of equal length.

    Raises
    ------
    ArgumentTypeError
        The argument is neither a DataFrame nor a mapping.
    ArgumentError
        Columns are of different lengths.
    """
    if not isinstance(table, Mapping) and not (hasattr(table, "columns") and hasattr(table, "__getitem__")):
        raise ArgumentTypeError(argument, f"be {must}", f"is {what_it_is(table)}")
    names = list(table) if isinstance(table, Mapping) else [str(name) for name in table.columns]
    for name in names:
        if not hasattr(table[name], "__iter__"):
            raise ArgumentTypeError(argument, f"have a list or an array in column {name}", f"has {table[name]!r}")
    columns = {str(name): list(table[name]) for name in names}
    lengths = {len(column) for column in columns.values()}
    if len(lengths) > 1:
        raise ArgumentError(argument, "have columns of one length", f"has lengths {sorted(lengths)}")
    return columns


def _values(
    argument: str, columns: Mapping[str, list[Any]], needed: tuple[str, ...], known: tuple[str, ...]
) -> dict[str, Numbers]:
    """Return the known columns of a table as numbers; those that are needed must be there."""
    for name in needed:
        if name not in columns:
            raise ArgumentError(argument, f"have a column {name}", f"has {', '.join(columns) or 'none'}")
    return {name: _numbers(argument, name, columns[name]) for name in known if name in columns}


def _numbers(argument: str, name: str, cells: list[Any]) -> Numbers:
    present = np.array([not _is_missing(cell) for cell in cells], dtype=bool)
    value = np.zeros(len(cells))
    for row in np.flatnonzero(present).tolist():
        try:
            value[row] = _real(cells[row])
        except (TypeError, ValueError):
            raise ArgumentError(
                argument, f"have real numbers in column {name}", f"has {cells[row]!r} in row {row}"
            ) from None
    if not np.all(np.isfinite(value)):
        raise ArgumentError(argument, f"have finite numbers in column {name}", "has an infinite one")
    return Numbers(value, present)


def _real(cell: Any) -> float:
    """Return a cell as a number; NumPy makes floats of truth values, and of complex numbers with a mere warning."""
    if isinstance(cell, bool | np.bool | complex | np.complexfloating):
        raise TypeError
    return float(cell)


def _is_missing(cell: Any) -> bool:
    """Whether a cell is empty: None, masked, pandas' NA, or NaN, which represents a missing value in a DataFrame."""
    empty = cell is None or cell is np.ma.masked or type(cell).__name__ in ("NAType", "NaTType")
    return empty or (isinstance(cell, float) and cell != cell)

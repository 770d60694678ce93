"""Reader of simulation tables: `input_mm,gap_mm[,left_mm,right_mm,force_n]`, at least two rows, in any order."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.models.table import TableModel
from fingervision.storage.csv_columns import read_columns
from fingervision.storage.number_columns import Numbers, numbers_in


def read_simulation_table(path: Path) -> TableModel:
    """Read a simulation table as a model.

    Raises
    ------
    DataError, InputFileError
        A column is missing, a cell is empty, there are fewer than two rows, an input occurs twice, or the gap is the
        same at all inputs.
    """
    cells = read_columns(path, ("input_mm", "gap_mm"), ("left_mm", "right_mm", "force_n"))
    return simulation_rows(path, {name: numbers_in(path, name, texts) for name, texts in cells.items()})


def simulation_rows(path: Path, columns: Mapping[str, Numbers]) -> TableModel:
    """Convert the columns of a simulation table to a model.

    Parameters
    ----------
    path : Path
        File of the columns, for error messages and as the name of the model.
    columns : mapping of str to Numbers
        Columns `input_mm, gap_mm` and, if present, `left_mm, right_mm, force_n`.

    Raises
    ------
    DataError
        For the same reasons as in `read_simulation_table`.
    """
    for name, each in columns.items():
        if not each.complete:
            raise DataError(
                f"{name} must have a number in every row of a simulation table, but data row "
                f"{int(np.argmin(each.present)) + 1} of {path} is empty: fill it, or remove the row."
            )
    column = {name: each.value for name, each in columns.items()}
    inputs = column["input_mm"]
    if inputs.size < 2:
        raise DataError(f"{path} must have at least two rows, but has {inputs.size}: simulate the gap at more inputs.")
    order = np.argsort(inputs)
    if np.any(np.diff(inputs[order]) == 0.0):
        twice = inputs[order][np.flatnonzero(np.diff(inputs[order]) == 0.0)[0]]
        raise DataError(f"input_mm must be unique, but {twice:g} occurs twice in {path}: remove one row.")
    if np.ptp(column["gap_mm"]) == 0.0:
        raise DataError(
            f"gap_mm must depend on the input, but is {column['gap_mm'][0]:g} in every row of {path}: "
            "check what the simulation exported."
        )
    if "left_mm" in column and "right_mm" in column:
        left, right = column["left_mm"], column["right_mm"]
    else:
        left, right = -0.5 * column["gap_mm"], 0.5 * column["gap_mm"]
    force = column["force_n"][order] if "force_n" in column else None
    return TableModel(path.name, inputs[order], left[order], right[order], force)

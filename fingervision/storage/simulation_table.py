"""Simulation tables, `input_mm,gap_mm[,left_mm,right_mm,force_n]`, and simulated motions over time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError
from fingervision.domain.response import Response
from fingervision.models.table import TableModel
from fingervision.storage.csv_columns import Numbers, read_columns
from fingervision.storage.row_file import write_table

COLUMNS = ("input_mm", "gap_mm", "left_mm", "right_mm", "force_n")
POSE = ("x_mm", "y_mm", "angle_mrad")
"""Pose columns of every body: displacement of the centroid of its area from the drawing, and rotation from x (right)
towards y (up)."""


def pose_columns(bodies: Mapping[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """Names of the pose columns `body.x_mm`, `body.y_mm`, `body.angle_mrad` of every body.

    Parameters
    ----------
    bodies : mapping of str to ndarray of float, shape (n, 3)
        Poses of every body (x in mm, y in mm, angle in mrad).
    """
    return {f"{name}.{part}": rows[:, place] for name, rows in bodies.items() for place, part in enumerate(POSE)}


def read_simulation_table(path: Path, followed: str = "") -> TableModel:
    """Read a simulation table as a model.

    Parameters
    ----------
    path : Path
        The file.
    followed : str
        Name of a column that stands for the gap; empty for the gap itself.

    Raises
    ------
    DataError, InputFileError
        A column is missing, a cell is empty, there are fewer than two rows, an input occurs twice, or the gap is the
        same at all inputs.
    """
    needed, others = ((COLUMNS[0], followed), COLUMNS[-1:]) if followed else (COLUMNS[:2], COLUMNS[2:])
    table = read_columns(path, needed, others)
    columns = {name: table.numbers(name, complete=True) for name in (*needed, *others) if name in table}
    return simulation_rows(path, {"gap_mm" if name == followed else name: each for name, each in columns.items()})


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


def write_simulation(
    path: Path,
    input_mm: NDArray[np.float64],
    response: Response,
    bodies: Mapping[str, NDArray[np.float64]] = MappingProxyType({}),
    comment: str = "",
) -> None:
    """Write a simulation table with one row per input.

    Parameters
    ----------
    path : Path
        File to write.
    input_mm : ndarray of float, shape (n,)
        Displacements of the drive.
    response : Response
        Response of the model to these inputs.
    bodies : mapping of str to ndarray of float, shape (n, 3)
        Poses of the bodies, written as the last columns of the table.
    comment : str
        First line of the file, if there is something to say.
    """
    named = {
        "input_mm": input_mm,
        "gap_mm": response.gap_mm,
        "left_mm": response.left_mm,
        "right_mm": response.right_mm,
    }
    force = {} if response.force_n is None else {"force_n": response.force_n}
    columns = {**named, **force, **pose_columns(bodies)}
    write_table(path, list(columns), list(zip(*columns.values(), strict=True)), comment)


def write_motion(
    path: Path,
    drive: DriveHistory,
    observed_mm: Mapping[str, NDArray[np.float64]],
    force_n: NDArray[np.float64],
    *,
    symmetric: bool = False,
) -> None:
    """Write a measured table with one row per sample of the drive.

    Parameters
    ----------
    path : Path
        File to write.
    drive : DriveHistory
        Times, inputs and runs of the drive.
    observed_mm : mapping of str to ndarray of float, shape (n,)
        Columns by name; `compare` and `diagnose` accept the table if one of them is `gap_mm`.
    force_n : ndarray of float, shape (n,)
        Force at the drive.
    symmetric : bool
        Whether both fingers move symmetrically, so that each is at half the gap from the centre.
    """
    runs = {} if drive.run is None else {"run": drive.run}
    columns: dict[str, Sequence[object] | NDArray[np.float64]] = {
        **runs, "time_s": drive.time_s, "input_mm": drive.input_mm, **observed_mm,
    }  # fmt: skip
    if symmetric:
        columns |= {"left_mm": -0.5 * observed_mm["gap_mm"], "right_mm": 0.5 * observed_mm["gap_mm"]}
    columns["force_n"] = force_n
    write_table(path, list(columns), list(zip(*columns.values(), strict=True)))

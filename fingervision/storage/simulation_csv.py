"""Write a model's simulation table: `input_mm,gap_mm,left_mm,right_mm[,force_n]` and poses of bodies."""

import csv
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.response import Response

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
    columns = {
        "input_mm": input_mm,
        "gap_mm": response.gap_mm,
        "left_mm": response.left_mm,
        "right_mm": response.right_mm,
    }
    if response.force_n is not None:
        columns["force_n"] = response.force_n
    columns |= pose_columns(bodies)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {comment}\n" if comment else "")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow([f"{value:.9g}" for value in row])

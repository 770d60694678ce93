"""Write a simulation table, `input_mm,gap_mm,left_mm,right_mm[,force_n]`, from a model's answer."""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.response import Response


def write_simulation(path: Path, input_mm: NDArray[np.float64], response: Response) -> None:
    """Write one row an input; `fingervision.storage.simulation_table` reads it.

    Parameters
    ----------
    path : Path
        File to write.
    input_mm : ndarray of float, shape (n,)
        Inputs.
    response : Response
        The model's answer to them.
    """
    columns = {
        "input_mm": input_mm,
        "gap_mm": response.gap_mm,
        "left_mm": response.left_mm,
        "right_mm": response.right_mm,
    }
    if response.force_n is not None:
        columns["force_n"] = response.force_n
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow([f"{value:.9g}" for value in row])

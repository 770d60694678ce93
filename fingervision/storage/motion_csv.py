"""A simulated motion as a measured table: `[run,]time_s,input_mm[,gap_mm,left_mm,right_mm],...,force_n`."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory

_GAP = "gap_mm"


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
    columns = {"time_s": drive.time_s, "input_mm": drive.input_mm, **observed_mm}
    if symmetric:
        columns |= {"left_mm": -0.5 * observed_mm[_GAP], "right_mm": 0.5 * observed_mm[_GAP]}
    columns["force_n"] = force_n
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*(["run"] if drive.run is not None else []), *columns])
        for place, row in enumerate(zip(*columns.values(), strict=True)):
            cells = [f"{value:.9g}" for value in row]
            writer.writerow([drive.run[place], *cells] if drive.run is not None else cells)

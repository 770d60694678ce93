"""Results of Modelica programs (Dymola, OpenModelica): a MATLAB 4 file with names, units and values apart."""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawColumn, RawTable, check_columns

ORDER = 25
IN_OWN_PROCESS = True
UNIT = re.compile(r"\[([^\]|:#]*)")
"""Unit of the values in a description: `Position [m|mm]`; the unit in which a program displays them follows the bar."""
HEADER_BYTES = 20
"""Length of the numbers before the name of a variable of MATLAB 4."""


def recognises(path: Path, head: bytes) -> bool:
    """Whether the first variable is `Aclass`, which states the layout."""
    return head[HEADER_BYTES : HEADER_BYTES + 7] == b"Aclass\0"


def read(path: Path, given: Entry) -> RawTable:
    """Read the variables that change in time."""
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        content = loadmat(str(path), chars_as_strings=False)
    return _table(path, content)


def _table(path: Path, content: dict[str, Any]) -> RawTable:
    layout = _words(content["Aclass"])
    if layout[0] != "Atrajectory" or layout[-1] not in ("binTrans", "binNormal"):
        raise DataError(f"{path} must hold trajectories (Atrajectory), but holds {layout}: export it as CSV.")
    turn = layout[-1] == "binTrans"
    names, about = (_words(content[key].T if turn else content[key]) for key in ("name", "description"))
    info = content["dataInfo"] if turn else content["dataInfo"].T
    values = np.asarray(content["data_2"] if turn else content["data_2"].T, dtype=np.float64)
    # Matrix 1 holds parameters; 0 denotes the time, whose values are in matrix 2 as well.
    moving = [k for k in range(len(names)) if int(info[0, k]) in (0, 2)]
    check_columns(path, len(moving))
    columns = []
    for k in moving:
        row = int(info[1, k])
        unit = UNIT.search(about[k])
        content_of = Numbers.whole(np.sign(row) * values[abs(row) - 1])
        columns.append(RawColumn(names[k], content_of, unit[1].strip() if unit else ""))
    return RawTable(path, "result of a Modelica program", tuple(columns), settings={}, named=True)


def _words(characters: np.ndarray) -> list[str]:
    """Texts of the rows of a matrix of characters."""
    return ["".join(row).rstrip("\0 ") for row in characters.tolist()]

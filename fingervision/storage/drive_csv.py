"""drive.csv: the recorded input, `time_s,input_mm[,run][,force_n]`."""

import csv
from math import isfinite
from pathlib import Path

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import FingervisionError


def read_drive(path: Path) -> DriveHistory:
    """Read a drive table.

    Lines that start with `#` are comments; columns may stand in any order, and others than these are not looked at.

    Raises
    ------
    FingervisionError
        The file cannot be read, a column is missing, a cell is no number, times do not increase, or a run comes back
        after another.
    """
    lines = _lines(path)
    if not lines:
        raise FingervisionError(f"{path} must have a header line time_s,input_mm[,run][,force_n], but is empty.")
    header = [cell.strip() for cell in lines[0][1]]
    for name in ("time_s", "input_mm"):
        if header.count(name) != 1:
            raise FingervisionError(f"{path} must have one column {name}, but its header is {','.join(header)}.")
    if len(lines) == 1:
        raise FingervisionError(f"{path} must have at least one row below its header, but has none.")
    columns: dict[str, list[float]] = {name: [] for name in ("time_s", "input_mm", "force_n") if name in header}
    runs: list[str] = []
    for line, cells in lines[1:]:
        if len(cells) != len(header):
            raise FingervisionError(f"Line {line} of {path} must have {len(header)} cells, but has {len(cells)}.")
        for name, values in columns.items():
            values.append(_number(path, line, name, cells[header.index(name)]))
        times = columns["time_s"]
        if len(times) > 1 and not times[-1] > times[-2]:
            raise FingervisionError(
                f"time_s must increase from row to row, but in line {line} of {path} it is {times[-1]:g} "
                f"after {times[-2]:g}: put all runs on the recording's clock, in order."
            )
        if "run" in header:
            runs.append(cells[header.index("run")].strip())
            if len(runs) > 1 and runs[-1] != runs[-2] and runs[-1] in runs[:-1]:
                raise FingervisionError(
                    f"The rows of a run must stand together, but run {runs[-1]} comes back in line {line} of {path}."
                )
    return DriveHistory(
        time_s=np.array(columns["time_s"]),
        input_mm=np.array(columns["input_mm"]),
        run=tuple(runs) if "run" in header else None,
        force_n=np.array(columns["force_n"]) if "force_n" in header else None,
    )


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Rows with their line numbers; comments and empty lines left out."""
    if path.exists() and not path.is_file():
        raise FingervisionError(
            f"{path} must be a table in a file, but is a folder or a pipe: save it as a file first."
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise FingervisionError(f"There is no drive table {path}.") from None
    except OSError as error:
        raise FingervisionError(f"The drive table {path} could not be read ({error.strerror}).") from error
    except UnicodeDecodeError as error:
        raise FingervisionError(f"{path} must be a CSV table in UTF-8, but is not: {error.reason}.") from error
    rows = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() and not line.startswith("#"):
            try:
                rows.append((number, next(csv.reader([line], strict=True))))
            except csv.Error as error:
                raise FingervisionError(
                    f"Line {number} of {path} has a quote that cannot be read ({error}): close or remove it."
                ) from error
    return rows


def _number(path: Path, line: int, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise FingervisionError(f"{name} in line {line} of {path} must be a number, but is '{cell.strip()}'.")
    return value

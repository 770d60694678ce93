"""The recorded input over time: the file drive.csv, and samples.csv of a run on the test bed."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError
from fingervision.domain.field import Field, names_of
from fingervision.domain.status import Status
from fingervision.storage.csv_columns import read_columns
from fingervision.storage.durable import replaced, written
from fingervision.storage.plain_file import plain
from fingervision.storage.row_file import RowFile, line_of, row_of

COLUMNS = ("time_s", "input_mm", "force_n")


def read_drive(path: Path) -> DriveHistory:
    """Read a drive table.

    Lines that start with `#` are comments; the columns may be in any order, and other columns are ignored.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, a column is missing, a cell is not a number, times do not increase, or the rows of a
        run are not contiguous.
    """
    table = read_columns(path, COLUMNS[:2], COLUMNS[2:], texts=("run",))
    if not table.lines:
        raise DataError(f"{path} must have at least one row below its header, but has none.")
    values = {name: table.numbers(name, complete=True).value for name in COLUMNS if name in table}
    runs = table.texts("run")
    return drive_rows(path, values, None if runs is None else tuple(runs), table.lines)


def drive_rows(
    path: Path, values: Mapping[str, NDArray[np.float64]], runs: tuple[str, ...] | None, lines: Sequence[int]
) -> DriveHistory:
    """Select the columns of a drive table, and check that times increase and rows of a run are contiguous.

    Parameters
    ----------
    path : Path
        File of the columns, for error messages.
    values : mapping of str to ndarray of float, shape (n,)
        Columns `time_s`, `input_mm` and, if recorded, `force_n`.
    runs : tuple of str, length n, or None
        Name of the run of each row.
    lines : sequence of int, length n
        Line number in the file of each row.

    Raises
    ------
    DataError
        Times do not increase, or the rows of a run are not contiguous.
    """
    times = values["time_s"]
    back = np.flatnonzero(~(np.diff(times) > 0.0))
    if back.size:
        at = int(back[0]) + 1
        raise DataError(
            f"time_s must increase from row to row, but in line {lines[at]} of {path} it is {times[at]:g} "
            f"after {times[at - 1]:g}: state the times of all runs on the recording's clock, in rising order."
        )
    seen: set[str] = set()
    for at in range(1, len(runs) if runs is not None else 0):
        if runs is not None and runs[at] != runs[at - 1]:
            seen.add(runs[at - 1])
            if runs[at] in seen:
                raise DataError(
                    f"The rows of one run must follow each other, but run {runs[at]} starts again in line "
                    f"{lines[at]} of "
                    f"{path}."
                )
    return DriveHistory(times, values["input_mm"], runs, values.get("force_n"))


DRIVE_LOG = "drive_log.csv"
"""The drive's log on the recording's clock, in the folder of gaps.csv."""
LOG_TIME_PLACES = 9


def write_drive_log(path: Path, drive: DriveHistory) -> None:
    """Write a log with the digits of its inputs, from which the step of an encoder is found.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    names = ["time_s", "input_mm", *(["run"] if drive.run is not None else [])]
    runs = drive.run if drive.run is not None else [None] * drive.time_s.size
    with (
        written(path, "free disk space or name another folder with --out, and measure again") as part,
        part.open("w", encoding="utf-8", newline="") as file,
    ):
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(names)
        for time_s, input_mm, run in zip(drive.time_s.tolist(), drive.input_mm.tolist(), runs, strict=True):
            rows.writerow([f"{time_s:.{LOG_TIME_PLACES}f}", input_mm, run][: len(names)])


# The file samples.csv of a run on the test bed: a measured table with additional columns.

# Decimal places: a microsecond, a tenth of a nanometre and a micronewton are below any uncertainty.
TIME_PLACES, MM_PLACES, FORCE_PLACES = 6, 7, 6


@dataclass(frozen=True, slots=True)
class SampleRow:
    """One row of samples.csv; None is written as an empty cell."""

    run: Annotated[str, Field("name of the run; a re-zeroing, or any other loss of continuity, begins a new run")]
    time_s: Annotated[float, Field("time since the first row, by the camera's clock", "s", TIME_PLACES)]
    input_mm: Annotated[
        float | None,
        Field(
            "position of the stage at the time of the exposure, interpolated between the readings of its encoder",
            "mm",
            MM_PLACES,
        ),
    ]
    gap_mm: Annotated[float | None, Field("gap", "mm", MM_PLACES)]
    left_mm: Annotated[float | None, Field("positions of the measuring points", "mm", MM_PLACES)]
    right_mm: Annotated[float | None, Field("positions of the measuring points", "mm", MM_PLACES)]
    u_gap_mm: Annotated[
        float | None, Field("standard uncertainty of `gap_mm`, with the whole budget", "mm", MM_PLACES, low=0.0)
    ]
    u_random_mm: Annotated[float | None, Field("random part of `u_gap_mm`", "mm", MM_PLACES, low=0.0)]
    force_n: Annotated[float | None, Field("force at the drive at the time of the exposure", "N", FORCE_PLACES)]
    status: Annotated[Status, Field("as in gaps.csv")]
    frame: Annotated[int, Field("number of the frame in the video, from 0")]
    step: Annotated[int, Field("number of the recipe's step, from 1")]
    encoder_mm: Annotated[
        float | None, Field("most recent position reading of the actuator when the frame arrived", "mm", MM_PLACES)
    ]
    camera_s: Annotated[float, Field("time stamp of the frame by the camera's clock", "s", TIME_PLACES)]
    arrived_s: Annotated[float, Field("time of its arrival by the test bed's clock", "s", TIME_PLACES)]


SAMPLE_COLUMNS = ",".join(names_of(SampleRow))


@cache
def row_with(channels: tuple[str, ...]) -> type[SampleRow]:
    """The record of a row with further columns, one for each channel of the test bed, by their names."""
    value = Annotated[float | None, Field("value of a channel at the time of the exposure")]
    more = [(name, value, field(default=None)) for name in channels]
    return make_dataclass("SampleRow", more, bases=(SampleRow,), frozen=True, slots=True) if channels else SampleRow


class SamplesCsv(RowFile[SampleRow]):
    """Writes samples.csv row by row, with a column for each channel; `go_on` appends to an existing file."""

    def __init__(self, path: Path, channels: tuple[str, ...] = (), *, go_on: bool = False) -> None:
        super().__init__(path, row_with(channels), go_on=go_on)


def read_samples(path: Path) -> list[SampleRow]:
    """Read the complete rows of an interrupted run, and remove an incomplete last row from the file.

    Raises
    ------
    DataError
        The file is not the table of a run on the test bed.
    """
    try:
        text = plain(path).read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        lines = whole.decode("utf-8").splitlines()
        columns = lines[0] if lines else SAMPLE_COLUMNS
        ours, names = f"{columns},".startswith(f"{SAMPLE_COLUMNS},"), columns.split(",")
        record = row_with(tuple(names[len(SAMPLE_COLUMNS.split(",")) :])) if ours else SampleRow
        rows = [row_of(record, names, cells) for cells in csv.reader(lines[1:])] if ours else []
        if len(whole) < len(text):
            with path.open("rb+") as file:
                file.truncate(len(whole))
    except FileNotFoundError:
        return []
    except (OSError, ValueError, TypeError) as error:
        raise DataError(
            f"{path} must be the table of samples of the interrupted run, but cannot be read as one ({error}): name "
            "another folder with --out."
        ) from error
    if not ours:
        raise DataError(f"{path} must be the table of a run on the test bed, but has another header.")
    return rows


def write_rows(path: Path, rows: Sequence[SampleRow]) -> None:
    """Replace the table by the given rows; the file on disk is complete at any time."""
    record: Any = type(rows[-1]) if rows else SampleRow
    names = names_of(record)
    alike = (record(**{name: getattr(row, name, None) for name in names}) for row in rows)
    with replaced(path) as part:
        part.write_text("\n".join((",".join(names), *map(line_of, alike))) + "\n", encoding="utf-8")

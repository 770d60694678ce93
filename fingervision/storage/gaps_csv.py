"""The file gaps.csv: one row per video frame, written during the measurement and valid at any interruption."""

import csv
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Protocol

import numpy as np

from fingervision.domain.errors import DataError, OutputError
from fingervision.domain.field import Field, names_of
from fingervision.domain.status import Status
from fingervision.storage.csv_columns import read_columns
from fingervision.storage.durable import replaced
from fingervision.storage.row_file import RowFile, cell, quoted, row_of

# Decimal places; a nanosecond, a hundred-thousandth of a pixel and a tenth of a nanometre are below any uncertainty.
TIME_PLACES, PX_PLACES, MM_PLACES, FORCE_PLACES = 9, 5, 7, 6
# Inputs that differ by less (mm) count as one part, because stages do not return to a position more exactly.
SAME_INPUT_PLACES = 3


@dataclass(frozen=True, slots=True)
class GapRow:
    """One row of gaps.csv; None is written as an empty cell."""

    frame: Annotated[int, Field("number of the frame in the recording, from 0")]
    time_s: Annotated[
        float | None, Field("presentation time from the container; empty if there is none", "s", TIME_PLACES)
    ]
    status: Annotated[Status, Field("`ok`, or why there is no gap (table below)")]
    gap_mm: Annotated[float | None, Field("distance of the two measuring points", "mm", MM_PLACES)] = None
    u_gap_mm: Annotated[
        float | None,
        Field(
            "standard uncertainty of `gap_mm`, with everything in the calibration's budget; empty with a bare "
            "`--px-per-mm`, without `--u-px-per-mm`",
            "mm",
            MM_PLACES,
            low=0.0,
        ),
    ] = None
    u_random_mm: Annotated[
        float | None,
        Field(
            "random part of `u_gap_mm`, independent from frame to frame (standard uncertainty)",
            "mm",
            MM_PLACES,
            low=0.0,
        ),
    ] = None
    gap_px: Annotated[float | None, Field("gap in the picture", "px", PX_PLACES)] = None
    u_gap_px: Annotated[
        float | None, Field("random part of the standard uncertainty of `gap_px`", "px", PX_PLACES, low=0.0)
    ] = None
    left_x_px: Annotated[float | None, Field("coordinates of the measuring points", "px", PX_PLACES)] = None
    left_y_px: Annotated[float | None, Field("coordinates of the measuring points", "px", PX_PLACES)] = None
    right_x_px: Annotated[float | None, Field("coordinates of the measuring points", "px", PX_PLACES)] = None
    right_y_px: Annotated[float | None, Field("coordinates of the measuring points", "px", PX_PLACES)] = None
    left_tip_px: Annotated[float | None, Field("positions of the tips along the fingers' axis", "px", PX_PLACES)] = None
    right_tip_px: Annotated[float | None, Field("positions of the tips along the fingers' axis", "px", PX_PLACES)] = (
        None
    )
    left_mm: Annotated[
        float | None,
        Field("positions of the measuring points across the fingers, from the middle of the image", "mm", MM_PLACES),
    ] = None
    right_mm: Annotated[
        float | None,
        Field("positions of the measuring points across the fingers, from the middle of the image", "mm", MM_PLACES),
    ] = None
    u_shift_px: Annotated[
        float | None,
        Field(
            "standard uncertainty of `gap_px` by what remains undecided in the picture (such as a shadow) and is alike "
            "in every frame",
            "px",
            PX_PLACES,
            low=0.0,
        ),
    ] = None
    fingers: Annotated[str, Field("`dark` or `light` against the background; empty without a gap")] = ""
    held_px: Annotated[float | None, Field("width of a part held between the fingers", "px", PX_PLACES)] = None
    held_mm: Annotated[float | None, Field("width of a part held between the fingers", "mm", MM_PLACES)] = None
    run: Annotated[str, Field("with `--drive`: run at the time of the frame; empty if there is none")] = ""
    input_mm: Annotated[
        float | None,
        Field(
            "with `--drive`: input at the time of the frame. Empty outside the log, between two runs, and within a "
            "jump of the log from one place of rest to another",
            "mm",
            MM_PLACES,
        ),
    ] = None
    force_n: Annotated[
        float | None,
        Field("with `--drive`: force at the time of the frame, if the log has a force", "N", FORCE_PLACES),
    ] = None


DRIVE_COLUMNS = ("run", "input_mm", "force_n")
COLUMNS = ",".join(name for name in names_of(GapRow) if name not in DRIVE_COLUMNS)


class GapsCsv(RowFile[GapRow]):
    """Writes gaps.csv row by row.

    Parameters
    ----------
    path : Path
        The file; an existing file is replaced.
    drive_columns : tuple of str
        Columns for the drive: () or ("run", "input_mm") or ("run", "input_mm", "force_n").
    """

    def __init__(self, path: Path, drive_columns: tuple[str, ...] = ()) -> None:
        super().__init__(path, GapRow, (*COLUMNS.split(","), *drive_columns))


class GapsReader:
    """Reads the complete lines of a gaps.csv that is still growing.

    Parameters
    ----------
    path : Path
        The file gaps.csv, which need not exist yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: list[GapRow] = []
        """The rows of the file so far, in a new list after each change."""
        self._columns: tuple[str, ...] = ()
        self._place, self._last_line = 0, b""
        self._file: tuple[int, int] | None = None

    def refresh(self) -> bool:
        """Read the rows that were added to the file; return True if the file was replaced, and all rows are new.

        A file is another one if the operating system numbers it differently, or if it no longer has, at the same
        place, the line that was read last.

        Raises
        ------
        OSError
            The table exists but cannot be read.
        DataError
            A line has not as many cells as the header.
        """
        try:
            with self.path.open("rb") as file:
                status = os.fstat(file.fileno())
                identity = status.st_dev, status.st_ino
                file.seek(self._place - len(self._last_line))
                # Until its header is written, a file has nothing that could have been read of it.
                is_same = (
                    self._place > 0 and identity == self._file and file.read(len(self._last_line)) == self._last_line
                )
                if not is_same:
                    file.seek(0)
                text = file.read()
        except FileNotFoundError:
            return False
        is_replaced = not is_same and self._place > 0
        whole = text[: text.rfind(b"\n") + 1]
        lines = whole.splitlines(keepends=True)
        table = list(csv.reader(line.decode("utf-8") for line in lines))
        columns = self._columns if is_same else tuple(table.pop(0) if table else ())
        for cells in table:
            if len(cells) != len(columns):
                raise DataError(
                    f"Each line of {self.path} must have {len(columns)} cells, as its header, but one has "
                    f"{len(cells)}: measure the recording again."
                )
        rows = [row_of(GapRow, columns, cells) for cells in table]
        if is_same and not rows:
            return False
        self.rows = self.rows + rows if is_same else rows
        self._file, self._columns = identity, columns
        self._place = len(whole) + (self._place if is_same else 0)
        self._last_line = lines[-1] if lines else b""
        return is_replaced


def read_gap_readings(path: Path, by_input: bool) -> dict[float | None, list[float]]:
    """Read the gaps of all video frames that have a gap, as repeated readings of parts for a study of repeatability.

    Parameters
    ----------
    path : Path
        A gaps.csv.
    by_input : bool
        Whether each different input of the drive counts as a separate part; otherwise the recording shows a single
        part, named None.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read or holds no gaps.
    """
    table = read_columns(path, ("gap_mm", "input_mm") if by_input else ("gap_mm",))
    gap = table.numbers("gap_mm")
    inputs = table.numbers("input_mm") if by_input else None
    readings: dict[float | None, list[float]] = {}
    for row in np.flatnonzero(gap.present if inputs is None else gap.present & inputs.present).tolist():
        part = None if inputs is None else round(float(inputs.value[row]), SAME_INPUT_PLACES)
        readings.setdefault(part, []).append(float(gap.value[row]))
    if not readings:
        raise DataError(f"The table {path} must hold at least one gap, but holds none: give a gaps.csv with gaps.")
    return readings


class Driven(Protocol):
    """Input and force of the drive at a frame's time."""

    @property
    def run(self) -> str:
        """Name of the run."""

    @property
    def input_mm(self) -> float:
        """Input displacement of the drive (mm)."""

    @property
    def force_n(self) -> float | None:
        """Force at the drive (N); None if not recorded."""


def with_drive(path: Path, state: Callable[[float], Driven | None], *, has_force: bool) -> None:
    """Fill the columns of the drive in a finished table, line by line.

    Parameters
    ----------
    path : Path
        A gaps.csv whose last columns are run, input_mm and, with `has_force`, force_n; the file is replaced once the
        new table is complete.
    state : callable
        Function that returns the state of the drive at a frame's time; None if the drive was not recorded at that time.
    has_force : bool
        Whether the table has a column force_n.

    Raises
    ------
    OutputError
        The table cannot be read, or its new version cannot be written; the old table is kept.
    """
    columns = 3 if has_force else 2
    try:
        with (
            replaced(path) as part,
            path.open(encoding="utf-8", newline="") as old,
            part.open("w", encoding="utf-8", newline="") as new,
        ):
            new.write(next(old))
            for line in old:
                cells = next(csv.reader([line]))
                found = state(float(cells[1])) if cells[1] else None
                if found is None:
                    new.write(line)
                    continue
                drive = [quoted(found.run), cell(found.input_mm, MM_PLACES), cell(found.force_n, FORCE_PLACES)]
                kept = line.rstrip("\r\n").rsplit(",", columns)[0]
                new.write(",".join([kept, *drive[:columns]]) + "\n")
    except OSError as error:
        raise OutputError(
            f"The drive's inputs could not be added to {path} ({error.strerror}); the file holds the gaps only: free "
            "disk space and measure again."
        ) from error

"""The file gaps.csv: one row per video frame, written during the measurement and valid at any interruption."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Protocol

from fingervision.domain.errors import OutputError
from fingervision.domain.status import Status
from fingervision.storage.durable import replaced
from fingervision.storage.line_file import LineFile, cell, quoted

COLUMNS = (
    "frame,time_s,status,gap_mm,u_gap_mm,u_random_mm,gap_px,u_gap_px,"
    "left_x_px,left_y_px,right_x_px,right_y_px,left_tip_px,right_tip_px,left_mm,right_mm,"
    "u_shift_px,fingers,held_px,held_mm"
)
# Decimal places; a nanosecond, a hundred-thousandth of a pixel and a tenth of a nanometre are below any uncertainty.
TIME_PLACES, PX_PLACES, MM_PLACES, FORCE_PLACES = 9, 5, 7, 6


@dataclass(frozen=True, slots=True)
class GapRow:
    """One row of gaps.csv; None is written as an empty cell.

    Parameters
    ----------
    frame : int
        Number of the video frame in the recording, from 0.
    time_s : float or None
        Presentation time of the frame.
    status : Status
        Whether the frame has a gap, and if not, the reason.
    gap_mm, u_gap_mm, u_random_mm : float or None
        Gap, its standard uncertainty with all contributions of the budget, and the random part of this uncertainty.
    gap_px, u_gap_px : float or None
        Gap in the picture and its random standard uncertainty.
    left_x_px, left_y_px, right_x_px, right_y_px : float or None
        Coordinates of the two measuring points in the picture.
    left_tip_px, right_tip_px : float or None
        Coordinates of the tips along the fingers' axis.
    left_mm, right_mm : float or None
        Coordinates of the measuring points across the fingers, from the centre of the picture.
    u_shift_px : float or None
        Standard uncertainty of `gap_px` from systematic effects in the picture, equal in every frame.
    fingers : str
        `dark` or `light`: brightness of the fingers relative to the background; empty without a gap.
    held_px, held_mm : float or None
        Width of a part held between the fingers.
    run : str
        Run of the drive to which the frame belongs; empty if there is none.
    input_mm, force_n : float or None
        Input displacement and force of the drive at the frame's time.
    """

    frame: int
    time_s: float | None
    status: Status
    gap_mm: float | None = None
    u_gap_mm: float | None = None
    u_random_mm: float | None = None
    gap_px: float | None = None
    u_gap_px: float | None = None
    left_x_px: float | None = None
    left_y_px: float | None = None
    right_x_px: float | None = None
    right_y_px: float | None = None
    left_tip_px: float | None = None
    right_tip_px: float | None = None
    left_mm: float | None = None
    right_mm: float | None = None
    u_shift_px: float | None = None
    fingers: str = ""
    held_px: float | None = None
    held_mm: float | None = None
    run: str = ""
    input_mm: float | None = None
    force_n: float | None = None


class GapsCsv:
    """Writes gaps.csv row by row.

    Complete rows are written to the file at least every second. If the disk is full, the file is truncated after its
    last complete row.

    Parameters
    ----------
    path : Path
        The file; an existing file is replaced.
    drive_columns : tuple of str
        Columns for the drive: () or ("run", "input_mm") or ("run", "input_mm", "force_n").

    Raises
    ------
    FingervisionError
        The file cannot be written; also from `add` and `close`.
    """

    def __init__(self, path: Path, drive_columns: tuple[str, ...] = ()) -> None:
        self._drive_columns = drive_columns
        self._file = LineFile(path, ",".join((COLUMNS, *drive_columns)))

    def __enter__(self) -> "GapsCsv":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add(self, rows: Sequence[GapRow]) -> None:
        """Add rows, in order."""
        self._file.add([self._line(row) for row in rows])

    def close(self) -> None:
        """Write pending rows and close the file; closing twice is allowed."""
        self._file.close()

    def _line(self, row: GapRow) -> str:
        cells = [
            str(row.frame),
            cell(row.time_s, TIME_PLACES),
            row.status.value,
            cell(row.gap_mm, MM_PLACES),
            cell(row.u_gap_mm, MM_PLACES),
            cell(row.u_random_mm, MM_PLACES),
            cell(row.gap_px, PX_PLACES),
            cell(row.u_gap_px, PX_PLACES),
            cell(row.left_x_px, PX_PLACES),
            cell(row.left_y_px, PX_PLACES),
            cell(row.right_x_px, PX_PLACES),
            cell(row.right_y_px, PX_PLACES),
            cell(row.left_tip_px, PX_PLACES),
            cell(row.right_tip_px, PX_PLACES),
            cell(row.left_mm, MM_PLACES),
            cell(row.right_mm, MM_PLACES),
            cell(row.u_shift_px, PX_PLACES),
            row.fingers,
            cell(row.held_px, PX_PLACES),
            cell(row.held_mm, MM_PLACES),
        ]
        if self._drive_columns:
            cells += [quoted(row.run), cell(row.input_mm, MM_PLACES)]
        if "force_n" in self._drive_columns:
            cells.append(cell(row.force_n, FORCE_PLACES))
        return ",".join(cells)


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

"""The file samples.csv of a run on the test bed: a measured table with additional columns."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.domain.status import Status
from fingervision.storage.durable import replaced
from fingervision.storage.line_file import LineFile, cell, quoted
from fingervision.storage.plain_file import plain

COLUMNS = (
    "run,time_s,input_mm,gap_mm,left_mm,right_mm,u_gap_mm,u_random_mm,force_n,status,frame,step,encoder_mm,camera_s,"
    "arrived_s"
)
# Decimal places: a microsecond, a tenth of a nanometre and a micronewton are below any uncertainty.
TIME_PLACES, MM_PLACES, FORCE_PLACES = 6, 7, 6


@dataclass(frozen=True, slots=True)
class SampleRow:
    """One row of samples.csv; None is written as an empty cell.

    Parameters
    ----------
    run : str
        Name of the run; a re-zeroing, or any other loss of continuity, begins a new run.
    time_s : float
        Time since the first row of the folder, by the camera's clock.
    input_mm : float or None
        Position of the stage at the time of the exposure, interpolated between the readings of its encoder.
    gap_mm, left_mm, right_mm : float or None
        Gap, and positions of the measuring points.
    u_gap_mm, u_random_mm : float or None
        Standard uncertainty of the gap with all contributions of the budget, and its random part.
    force_n : float or None
        Force at the drive at the time of the exposure.
    status : Status
        Whether the frame has a gap, and if not, the reason.
    frame : int
        Number of the frame in the video, from 0.
    step : int
        Number of the recipe's step, from 1.
    encoder_mm : float or None
        Most recent position reading of the actuator when the frame arrived.
    camera_s, arrived_s : float
        Time stamp of the frame by the camera's clock, and time of its arrival by the test bed's clock.
    """

    run: str
    time_s: float
    input_mm: float | None
    gap_mm: float | None
    left_mm: float | None
    right_mm: float | None
    u_gap_mm: float | None
    u_random_mm: float | None
    force_n: float | None
    status: Status
    frame: int
    step: int
    encoder_mm: float | None
    camera_s: float
    arrived_s: float

    def line(self) -> str:
        """Return the row as a line of the file."""
        mm = (self.input_mm, self.gap_mm, self.left_mm, self.right_mm, self.u_gap_mm, self.u_random_mm)
        return ",".join(
            [
                quoted(self.run),
                cell(self.time_s, TIME_PLACES),
                *(cell(value, MM_PLACES) for value in mm),
                cell(self.force_n, FORCE_PLACES),
                self.status.value,
                str(self.frame),
                str(self.step),
                cell(self.encoder_mm, MM_PLACES),
                cell(self.camera_s, TIME_PLACES),
                cell(self.arrived_s, TIME_PLACES),
            ]
        )


class SamplesCsv:
    """Writes samples.csv row by row.

    Parameters
    ----------
    path : Path
        The file.
    go_on : bool
        Whether rows are appended to an existing file.
    """

    def __init__(self, path: Path, *, go_on: bool = False) -> None:
        self._file = LineFile(path, COLUMNS, go_on=go_on)

    def add(self, rows: Sequence[SampleRow]) -> None:
        """Add rows, in order."""
        self._file.add([row.line() for row in rows])

    def close(self) -> None:
        """Write pending rows and close the file."""
        self._file.close()


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
        columns = lines[0] if lines else COLUMNS
        rows = [_row(cells) for cells in csv.reader(lines[1:])] if columns == COLUMNS else []
        if len(whole) < len(text):
            with path.open("rb+") as file:
                file.truncate(len(whole))
    except FileNotFoundError:
        return []
    except (OSError, ValueError, IndexError) as error:
        raise DataError(
            f"{path} must be the table of samples of the interrupted run, but cannot be read as one ({error}): name "
            "another folder with --out."
        ) from error
    if columns != COLUMNS:
        raise DataError(f"{path} must be the table of a run on the test bed, but has another header.")
    return rows


def write_rows(path: Path, rows: Sequence[SampleRow]) -> None:
    """Replace the table by the given rows; the file on disk is complete at any time."""
    with replaced(path) as part:
        part.write_text("\n".join((COLUMNS, *(row.line() for row in rows))) + "\n", encoding="utf-8")


def _row(cells: list[str]) -> SampleRow:
    def number(at: int) -> float | None:
        return float(cells[at]) if cells[at] else None

    return SampleRow(
        cells[0], float(cells[1]), number(2), number(3), number(4), number(5), number(6), number(7), number(8),
        Status(cells[9]), int(cells[10]), int(cells[11]), number(12), float(cells[13]), float(cells[14]),
    )  # fmt: skip

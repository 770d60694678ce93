"""The file gauges.csv: one row per frame and measured quantity, `time_s,gauge,quantity,value,u,unit,status`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from fingervision.storage.line_file import LineFile, cell, quoted

COLUMNS = "time_s,gauge,quantity,value,u,unit,status"
# As in gaps.csv; a microradian is a thousandth of a milliradian.
TIME_PLACES, PLACES = 9, 7


@dataclass(frozen=True, slots=True)
class GaugeRow:
    """One row of gauges.csv; None is written as an empty cell.

    Parameters
    ----------
    time_s : float or None
        Presentation time of the frame.
    gauge, quantity : str
        Name of the gauge, and name of the quantity that it measures.
    value, u : float or None
        Measured value and its standard uncertainty.
    unit : str
        Unit of the value and its uncertainty: mm, px or mrad.
    status : str
        `ok`, or the reason why there is no value.
    """

    time_s: float | None
    gauge: str
    quantity: str
    value: float | None
    u: float | None
    unit: str
    status: str


class GaugeRows(list[GaugeRow]):
    """Collects rows in memory instead of writing them to a file."""

    def add(self, rows: Sequence[GaugeRow]) -> None:
        """Add rows, in order."""
        self.extend(rows)

    def close(self) -> None:
        """Do nothing: rows in memory need no closing."""


class GaugesCsv:
    """Writes gauges.csv row by row; complete rows are written to the file at least every second.

    Parameters
    ----------
    path : Path
        The file; an existing file is replaced.

    Raises
    ------
    FingervisionError
        The file cannot be written; also from `add` and `close`.
    """

    def __init__(self, path: Path) -> None:
        self._file = LineFile(path, COLUMNS)

    def __enter__(self) -> "GaugesCsv":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add(self, rows: Sequence[GaugeRow]) -> None:
        """Add rows, in order."""
        self._file.add([_line(row) for row in rows])

    def close(self) -> None:
        """Write pending rows and close the file; closing twice is allowed."""
        self._file.close()


def _line(row: GaugeRow) -> str:
    return ",".join(
        (
            cell(row.time_s, TIME_PLACES), quoted(row.gauge), row.quantity, cell(row.value, PLACES),
            cell(row.u, PLACES), row.unit, row.status,
        )
    )  # fmt: skip

"""The file gauges.csv: one row per frame and measured quantity, `time_s,gauge,quantity,value,u,unit,status`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.storage.row_file import RowFile

# As in gaps.csv; a microradian is a thousandth of a milliradian.
TIME_PLACES, PLACES = 9, 7


@dataclass(frozen=True, slots=True)
class GaugeRow:
    """One row of gauges.csv; None is written as an empty cell."""

    time_s: Annotated[float | None, Field("presentation time of the frame", "s", TIME_PLACES)]
    gauge: Annotated[str, Field("name of the gauge")]
    quantity: Annotated[str, Field("name of the quantity that the gauge measures")]
    value: Annotated[float | None, Field("measured value", places=PLACES)]
    u: Annotated[float | None, Field("standard uncertainty of the value", places=PLACES, low=0.0)]
    unit: Annotated[str, Field("unit of the value and its uncertainty: mm, px or mrad")]
    status: Annotated[str, Field("`ok`, or why there is no value")]


class GaugeRows(list[GaugeRow]):
    """Collects rows in memory instead of writing them to a file."""

    def add(self, rows: Sequence[GaugeRow]) -> None:
        """Add rows, in order."""
        self.extend(rows)

    def close(self) -> None:
        """Do nothing: rows in memory need no closing."""


class GaugesCsv(RowFile[GaugeRow]):
    """Writes gauges.csv row by row; an existing file is replaced."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, GaugeRow)

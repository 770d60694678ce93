"""The file flexures.csv: thickness and place of a mechanism's flexures at rest."""

import csv
from collections.abc import Sequence
from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.domain.flexure_outline import FlexureOutline
from fingervision.storage.row_file import write_table

FLEXURES = "flexures.csv"
COLUMNS = ("flexure", "frames", "thickness_mm", "u_thickness_mm", "along_mm", "u_along_mm", "across_mm", "u_across_mm")


def write_flexures(path: Path, outlines: Sequence[FlexureOutline]) -> None:
    """Write flexures.csv; an empty cell represents a missing value."""
    rows = []
    for one in outlines:
        pairs = (one.thickness_mm, one.along_mm or ("", ""), one.across_mm)
        cells = [f"{value:.6f}" if value != "" else "" for pair in pairs for value in pair]
        rows.append([one.flexure, one.frames, *cells])
    write_table(path, COLUMNS, rows)


def flexures_beside(table: Path) -> dict[str, FlexureOutline]:
    """Read the flexures.csv beside a measured table, by the flexure's name; empty if there is none.

    Raises
    ------
    DataError
        The file is not a flexures.csv.
    """
    path = table.parent / FLEXURES
    if not path.is_file():
        return {}
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return {row["flexure"]: _outline(row) for row in csv.DictReader(file)}
    except (KeyError, TypeError, ValueError, UnicodeDecodeError) as error:
        raise DataError(
            f"{path} must have the columns {','.join(COLUMNS)} with numbers, but has not: measure the recording again, "
            "or remove the file."
        ) from error


def _outline(row: dict[str, str]) -> FlexureOutline:
    def pair(name: str) -> tuple[float, float]:
        return float(row[f"{name}_mm"]), float(row[f"u_{name}_mm"])

    along = pair("along") if row["along_mm"] else None
    return FlexureOutline(row["flexure"], int(row["frames"]), pair("thickness"), along, pair("across"))

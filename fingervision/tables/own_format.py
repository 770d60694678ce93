"""Recognition of fingervision's own tables: those that are read literally, and those that cannot be what is wanted."""

from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import header_of
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawTable

LONG_TABLES = {
    ("time_s", "body", "status", "angle_mrad"): "a bodies.csv, one row per body and frame",
    ("time_s", "gauge", "quantity", "value"): "a gauges.csv, one row per number",
}
"""Columns by which a table with several rows per frame is recognised, and its description."""


def refuse_long_table(raw: RawTable) -> None:
    """Refuse bodies.csv and gauges.csv, in which several rows have the same time.

    Raises
    ------
    DataError
        The table is a bodies.csv or a gauges.csv.
    """
    names = {column.name for column in raw.columns}
    for columns, what in LONG_TABLES.items():
        if names.issuperset(columns):
            raise DataError(
                f"{raw.path} must have one row per frame, but is {what}: give the gaps.csv of the same folder, which "
                "with --drive holds the poses of bodies as columns."
            )


GAPS = ("time_s", "status", "gap_mm", "gap_px")
"""Columns by which a gaps.csv is recognised."""


def refuse_gaps_without_input(raw: RawTable) -> None:
    """Refuse a gaps.csv that was measured without the record of the input, which none of its columns can replace.

    Raises
    ------
    DataError
        The table is a gaps.csv.
    """
    if {column.name for column in raw.columns}.issuperset(GAPS):
        raise DataError(
            f"{raw.path} must have a column input_mm, the recorded input of every frame, but was measured without: "
            "measure the recording again with --drive TABLE, the stage's record with times and positions."
        )


OWN = {"measured": ("input_mm", "gap_mm"), "drive": ("time_s", "input_mm"), "simulation": ("input_mm", "gap_mm")}


def is_own(path: Path, kind: str, given: Entry) -> bool:
    """Whether a table is in fingervision's own format, judged by its header line; True for an unreadable file.

    A table with an entry in columns.toml is read as this entry states.
    """
    if not given.says_nothing:
        return False
    if not path.is_file():
        return True
    names = header_of(path)
    return all(name in names for name in OWN[kind])

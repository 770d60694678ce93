"""Refuse this program's tables with several rows per frame as measured tables, and name the right table."""

from fingervision.domain.errors import DataError
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

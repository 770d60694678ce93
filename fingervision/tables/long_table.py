"""Refuse this program's own tables with several rows per frame as measured tables, and say which table to give."""

from fingervision.domain.errors import DataError
from fingervision.tables.raw_table import RawTable

LONG_TABLES = {
    ("time_s", "body", "status", "angle_mrad"): "a bodies.csv, one row per body and frame",
    ("time_s", "gauge", "quantity", "value"): "a gauges.csv, one row per number",
}
"""Columns that no other table has, and what such a table is."""


def refuse_long_table(raw: RawTable) -> None:
    """Refuse bodies.csv and gauges.csv, in which several rows have the same time.

    Raises
    ------
    DataError
        The table is one of these.
    """
    names = {column.name for column in raw.columns}
    for columns, what in LONG_TABLES.items():
        if names.issuperset(columns):
            raise DataError(
                f"{raw.path} must have one row per frame, but is {what}: give the gaps.csv of the same folder, which "
                "with --drive holds the poses of bodies as columns."
            )

"""Parquet files, read with pyarrow: columns of numbers, dates and texts."""

from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.needed_library import needed_library
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.parts import numbers
from fingervision.tables.raw_table import RawColumn, RawTable

ORDER = 40
IN_OWN_PROCESS = True
MOST_ROWS = 20_000_000
MOST_UNPACKED_BYTES = 4_000_000_000
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Seconds per unit of time in Arrow."""


def recognises(path: Path, head: bytes) -> bool:
    """Whether the first bytes of a file are those of a Parquet file."""
    return head.startswith(b"PAR1")


def read(path: Path, given: Entry) -> RawTable:
    """Read all columns that are not nested."""
    parquet = needed_library("pyarrow.parquet", "formats", f"{path} is a Parquet file, which", "save the table as CSV")
    file = parquet.ParquetFile(path)
    about = file.metadata
    size = sum(about.row_group(k).total_byte_size for k in range(about.num_row_groups))
    _check_size(path, about.num_rows, size)
    table = file.read()
    columns = [_column(table.schema.field(k), table.column(k).combine_chunks()) for k in range(table.num_columns)]
    kept = tuple(column for column in columns if column is not None)
    passed = [table.schema.field(k).name for k, column in enumerate(columns) if column is None]
    if not kept or not len(kept[0]):
        raise DataError(f"{path} must have a numeric column with at least one row, but has none.")
    notes = (f"Not read, because they are not columns of numbers or texts: {', '.join(passed)}.",) if passed else ()
    return RawTable(path, "Parquet", kept, notes=notes)


def _check_size(path: Path, rows: int, unpacked_bytes: int) -> None:
    """Refuse a table that is too large, before its values are read."""
    if rows > MOST_ROWS or unpacked_bytes > MOST_UNPACKED_BYTES:
        raise DataError(
            f"{path} must have at most {MOST_ROWS} rows and unpack to {MOST_UNPACKED_BYTES / 1e9:g} GB, but has {rows} "
            f"rows and {unpacked_bytes / 1e9:.1f} GB: save fewer rows or columns."
        )


def _column(field: Any, values: Any) -> RawColumn | None:
    from pyarrow import types

    unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
    kind = field.type
    if types.is_dictionary(kind):
        values, kind = values.dictionary_decode(), kind.value_type
    if types.is_integer(kind) or types.is_floating(kind) or types.is_decimal(kind):
        plain = values.cast("float64").fill_null(float("nan")).to_numpy(zero_copy_only=False)
        return RawColumn(field.name, numbers(plain), unit)
    if types.is_timestamp(kind) or types.is_duration(kind) or types.is_time(kind):
        whole = values.cast("int32").cast("int64") if types.is_time32(kind) else values.cast("int64")
        present = np.asarray(values.is_valid())
        ticks = whole.fill_null(0).to_numpy(zero_copy_only=False)
        first = ticks[present][0] if present.any() else 0
        # A float cannot hold nanoseconds since 1970 exactly: the first time is subtracted in whole numbers.
        zero = first if types.is_timestamp(kind) else 0
        seconds = np.where(present, (ticks - zero) / PER_SECOND[kind.unit], 0.0)
        stamped = types.is_timestamp(kind) and present.any()
        since = str(values.to_numpy(zero_copy_only=False)[int(np.argmax(present))]) if stamped else ""
        return RawColumn(field.name, Numbers(seconds, present), "s", since)
    if types.is_string(kind) or types.is_large_string(kind):
        return RawColumn(field.name, ["" if cell is None else str(cell) for cell in values.to_pylist()], unit)
    return None

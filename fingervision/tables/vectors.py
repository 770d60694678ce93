"""Convert named vectors and matrices of a file (MATLAB, TDMS) to columns of tables."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.csv_columns import Numbers
from fingervision.tables.raw_table import RawColumn

WIDEST = 200
"""Largest number of columns of a matrix; a wider matrix is considered as a picture."""

MOST_ROWS, LEAST_RATIO = 12, 3
"""Largest number of rows of a matrix with a row for each channel, and smallest ratio of its columns to its rows."""


def is_numeric(value: Any) -> bool:
    """Whether a value is an array of real numbers."""
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiub"


def numbers(value: NDArray[Any]) -> Numbers:
    """Convert an array of real numbers to a column; values that are not finite become missing values."""
    plain = np.asarray(value, dtype=np.float64).ravel()
    usable = np.isfinite(plain)
    return Numbers(np.where(usable, plain, 0.0), usable)


def tables_of(values: Mapping[str, Any]) -> dict[str, list[RawColumn]]:
    """Combine vectors of equal length to tables; each matrix and each structure becomes a separate table.

    Parameters
    ----------
    values : mapping of str to anything
        Arrays by name, and mappings of arrays for structures; any other value is ignored.

    Returns
    -------
    dict of str to list of RawColumn
        Columns of each table, by the name of the structure or matrix; `vectors of N` for separate vectors.
    """
    found: dict[str, list[RawColumn]] = {}
    loose: dict[int, list[RawColumn]] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            for part, columns in tables_of(value).items():
                key = name if part.startswith("vectors of ") else f"{name}.{part}"
                if key in found:  # vectors of several lengths in one structure
                    key = f"{name} ({len(columns[0])} rows)"
                found[key] = columns
        elif not is_numeric(value) or value.size < 2:
            continue
        elif value.ndim == 1 or (value.ndim == 2 and 1 in value.shape):
            loose.setdefault(value.size, []).append(RawColumn(name, numbers(value)))
        elif value.ndim == 2 and value.shape[0] <= MOST_ROWS and value.shape[1] >= LEAST_RATIO * value.shape[0]:
            # Programs that append samples as columns write a row for each channel.
            found[name] = [RawColumn(str(k + 1), numbers(row)) for k, row in enumerate(value)]
        elif value.ndim == 2 and value.shape[1] <= WIDEST:
            found[name] = [RawColumn(str(k + 1), numbers(value[:, k])) for k in range(value.shape[1])]
    for size, columns in loose.items():
        if len(columns) > 1:
            found[f"vectors of {size}"] = columns
    return found

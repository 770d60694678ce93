"""Files with several tables: vectors and matrices as columns of tables, and the choice of the table to read."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError, Question
from fingervision.tables.raw_table import RawColumn
from fingervision.tables.units import column_name

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


def chosen_part(path: Path, names: Mapping[str, Sequence[str]], given: Entry, what: str) -> str:
    """Name of the table to read: the one that the user states, the only one, or the only recognisable one.

    Parameters
    ----------
    path : Path
        The file.
    names : mapping of str to sequence of str
        Names of the columns in each part of the file.
    given : Entry
        Decisions of the user.
    what : str
        Word for a part in this file format (sheet, group).

    Raises
    ------
    DataError
        The file has no part with columns of numbers, or does not contain the stated part.
    OpenQuestionError
        Several parts may be the table, and the user has not chosen one.
    """
    listed = ", ".join(f"'{name}'" for name in names)
    if (stated := given.words.get("part")) is not None:
        if stated not in names:
            raise DataError(
                f"The key part must name a {what} of {path} ({listed or 'it has none'}), but is '{stated}'."
            )
        return stated
    if len(names) == 1:
        return next(iter(names))
    known: Callable[[str], int] = lambda part: len({r for n in names[part] if (r := column_name(n).role) is not None})  # noqa: E731
    fitting = [part for part in names if known(part) >= 2]
    if len(fitting) == 1:
        return fitting[0]
    if not names:
        raise DataError(f"{path} must hold a table, but has no {what} with columns of numbers: export it again.")
    example = (fitting or list(names))[0]
    raise OpenQuestionError(
        path, "table", [Question(f"it must be stated which {what} is meant: {listed}", f"part={example}")]
    )

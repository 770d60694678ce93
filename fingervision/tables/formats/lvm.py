"""LabVIEW measurement files (.lvm): a header with separator, decimal mark, channels and their units, then segments.

Source: National Instruments, "Specification for the LabVIEW Measurement File (.lvm)", version 2.0.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.numbers import to_number
from fingervision.storage.number_columns import Numbers
from fingervision.tables.cells import to_numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.text_file import lines_of

ORDER = 10
END = "***End_of_Header***"
COMMENT = "Comment"


def recognises(path: Path, head: bytes) -> bool:
    """Whether the file begins with the words of a LabVIEW measurement file."""
    return head.lstrip(b"\xef\xbb\xbf").startswith(b"LabVIEW Measurement")


def read(path: Path, given: Entry) -> RawTable:
    """Read all segments and join their rows."""
    lines, encoding = lines_of(path, given.words.get("encoding"))
    ends = [at for at, line in enumerate(lines) if line.strip().startswith(END)]
    if len(ends) < 2:
        raise DataError(
            f"{path} must have the line {END} after the file's header and after the header of each segment, but has "
            f"this line {len(ends)} times: save it again."
        )
    separator = "," if any(line.startswith("Separator,") or line == "Separator\tComma" for line in lines[: ends[0]]) \
        else "\t"  # fmt: skip
    top = _keys(lines[: ends[0]], separator)
    decimal = given.words.get("decimal") or (top.get("Decimal_Separator", ["."])[0] or ".")
    x_columns = top.get("X_Columns", ["One"])[0]
    columns: list[RawColumn] = []
    parts: list[tuple[list[np.ndarray], list[np.ndarray]]] = []
    numbers: list[int] = []
    restarts: list[int] = []
    odd = 0
    starts = [(ends[k - 1] + 1 if k > 1 else ends[0] + 1, ends[k]) for k in range(1, len(ends))]
    for k, (begin, end) in enumerate(starts):
        keys = _keys(lines[begin:end], separator)
        stop = _next_header(lines, end + 1, ends[k + 2] if k + 2 < len(ends) else len(lines))
        named = lines[end + 1].split(separator) if end + 1 < len(lines) else []
        segment, at, bad = _segment(lines, end + 2, stop, len(named), separator)
        names, units, taken, steps = _columns(named, keys, x_columns, decimal)
        if columns and [each.name for each in columns] != names:
            raise DataError(
                f"{path} must have the same channels in each segment, but line {end + 2} begins another "
                f"({', '.join(names)}): save the segments in files of their own."
            )
        odd += bad
        values, present = [], []
        for place, step in zip(taken, steps, strict=True):
            if step is not None:
                values.append(step[0] + step[1] * np.arange(len(at), dtype=np.float64))
                present.append(np.ones(len(at), dtype=np.bool_))
            else:
                column, unread = to_numbers([row[place] if place < len(row) else "" for row in segment], decimal)
                odd += int(unread.size)
                values.append(column.value)
                present.append(column.present)
        if parts:
            restarts.append(len(numbers))
        parts.append((values, present))
        numbers += at
        columns = [RawColumn(name, (), unit) for name, unit in zip(names, units, strict=True)]
    whole = [
        replace(
            column,
            content=Numbers(
                np.concatenate([values[k] for values, _ in parts]),
                np.concatenate([present[k] for _, present in parts]),
            ),
        )
        for k, column in enumerate(columns)
    ]
    return RawTable(
        path,
        f"LabVIEW measurement, {encoding}, {len(parts)} segment{'s' if len(parts) > 1 else ''}, decimal "
        f"{'point' if decimal == '.' else 'comma'}",
        tuple(whole),
        numbers,
        (f"{odd} cells or rows that could not be read",) if odd else (),
        (),
        np.array(restarts, dtype=np.intp),
    )


def _keys(lines: Sequence[str], separator: str) -> dict[str, list[str]]:
    """Read the keys and values of a header."""
    cells = [line.split(separator) for line in lines if line.strip()]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in cells}


def _next_header(lines: Sequence[str], begin: int, stop: int) -> int:
    """Index of the line at which a segment's rows end: the blank line before the next header."""
    for at in range(begin + 1, stop):
        if lines[at].startswith("Channels") or lines[at].strip().startswith("***"):
            return at
    return stop


def _segment(
    lines: Sequence[str], begin: int, stop: int, wide: int, separator: str
) -> tuple[list[list[str]], list[int], int]:
    """Rows of a segment, their line numbers, and the number of lines that are not rows."""
    rows, numbers, odd = [], [], 0
    for at in range(begin, stop):
        cells = [cell.strip() for cell in lines[at].split(separator)]
        if not any(cells):
            continue
        if len(cells) < wide - 1:  # the last column, the comment, may be missing
            odd += 1
            continue
        rows.append(cells)
        numbers.append(at + 1)
    return rows, numbers, odd


def _columns(
    named: Sequence[str], keys: dict[str, list[str]], x_columns: str, decimal: str
) -> tuple[list[str], list[str], list[int], list[tuple[float, float] | None]]:
    """Names, units and indices of the columns; start and step of columns whose values are not in the file."""
    y_units, dimensions = keys.get("Y_Unit_Label", []), keys.get("X_Dimension", [])
    is_time = (dimensions[0] if dimensions else "Time") == "Time"
    x_name, x_unit = ("Time", "s") if is_time else (dimensions[0], "")
    names: list[str] = []
    units: list[str] = []
    places: list[int] = []
    steps: list[tuple[float, float] | None] = []
    channel = 0
    for place, name in enumerate(cell.strip() for cell in named):
        if name == COMMENT or (not name and place == len(named) - 1):
            continue
        if name == "X_Value" or name.startswith("X_Value"):
            first = x_name not in names
            if x_columns == "No":
                starts = (to_number((keys.get(key) or [""])[0], decimal) for key in ("X0", "Delta_X"))
                start, step = starts
                if first and start is not None and step:
                    names.append(x_name)
                    units.append(x_unit)
                    places.append(place)
                    steps.append((start, step))
                continue
            if first:
                names.append(x_name)
                units.append(x_unit)
                places.append(place)
                steps.append(None)
            continue
        names.append(name)
        # With an X column for each channel, the header's values stand above these, and every second cell is empty.
        of_channel = place - 1 if x_columns == "Multi" else channel
        units.append(y_units[of_channel] if of_channel < len(y_units) else "")
        places.append(place)
        steps.append(None)
        channel += 1
    return names, units, places, steps

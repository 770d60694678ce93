"""LabVIEW measurement files (.lvm): a header with separator, decimal mark, channels and their units, then segments.

Source: National Instruments, "Specification for the LabVIEW Measurement File (.lvm)", version 2.0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.domain.numbers import to_number
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawTable
from fingervision.tables.text_file import lines_of
from fingervision.tables.text_table import table_of_lines

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
    text = [""] * len(lines)
    headers: list[str] = []
    odd = 0
    starts = [(ends[k - 1] + 1 if k > 1 else ends[0] + 1, ends[k]) for k in range(1, len(ends))]
    for k, (begin, end) in enumerate(starts):
        named = lines[end + 1].split(separator) if end + 1 < len(lines) else []
        columns = _columns(named, _keys(lines[begin:end], separator), x_columns, decimal)
        headers.append("\t".join(f"{each.name} [{each.unit}]" if each.unit else each.name for each in columns))
        if headers[-1] != headers[0]:
            raise DataError(
                f"{path} must have the same channels in each segment, but line {end + 2} begins another "
                f"({headers[-1].replace(chr(9), ', ')}): save the segments in files of their own."
            )
        text[end + 1] = headers[-1]
        row = 0
        for at in range(end + 2, _next_header(lines, end + 1, ends[k + 2] if k + 2 < len(ends) else len(lines))):
            cells = [cell.strip() for cell in lines[at].split(separator)]
            if len(cells) >= len(named) - 1 and any(cells):  # the last column, the comment, may be missing
                text[at] = "\t".join(each.cell(cells, row, decimal) for each in columns)
                row += 1
            odd += any(cells) and not text[at]
    words = {**given.words, "separator": "tab", "decimal": decimal}
    raw = table_of_lines(path, text, replace(given, words=words, header_line=ends[1] + 2), encoding)
    segments = f"{len(starts)} segment{'s' if len(starts) > 1 else ''}"
    return replace(
        raw,
        what=f"LabVIEW measurement, {encoding}, {segments}, decimal {'point' if decimal == '.' else 'comma'}",
        left_out=(f"{odd} rows that could not be read",) if odd else (),
        settings={"decimal": decimal} if decimal != "." else {},
    )


@dataclass(frozen=True, slots=True)
class _Column:
    """A column: name, unit, index; start and step of a column whose values are not in the file."""

    name: str
    unit: str
    place: int
    start_and_step: tuple[float, float] | None = None

    def cell(self, cells: Sequence[str], row: int, decimal: str) -> str:
        """Cell of this column in a row of its segment."""
        if self.start_and_step is None:
            return cells[self.place] if self.place < len(cells) else ""
        return repr(self.start_and_step[0] + self.start_and_step[1] * row).replace(".", decimal)


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


def _columns(named: Sequence[str], keys: dict[str, list[str]], x_columns: str, decimal: str) -> list[_Column]:
    """Columns of a segment, from the names above its rows and the keys of its header."""
    y_units, dimensions = keys.get("Y_Unit_Label", []), keys.get("X_Dimension", [])
    is_time = (dimensions[0] if dimensions else "Time") == "Time"
    x_name, x_unit = ("Time", "s") if is_time else (dimensions[0], "")
    found: list[_Column] = []
    channel = 0
    for place, name in enumerate(cell.strip() for cell in named):
        if name == COMMENT or (not name and place == len(named) - 1):
            continue
        if name.startswith("X_Value"):
            start, step = (to_number((keys.get(key) or [""])[0], decimal) for key in ("X0", "Delta_X"))
            stated = None if x_columns != "No" or start is None or not step else (start, step)
            if all(each.name != x_name for each in found) and (x_columns != "No" or stated is not None):
                found.append(_Column(x_name, x_unit, place, stated))
            continue
        # With an X column for each channel, the header's values stand above these, and every second cell is empty.
        of_channel = place - 1 if x_columns == "Multi" else channel
        found.append(_Column(name, y_units[of_channel] if of_channel < len(y_units) else "", place))
        channel += 1
    return found

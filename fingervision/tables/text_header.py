"""Lines of a text table that are no rows: names and units above the rows; statistics and more among them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from fingervision.domain.errors import DataError
from fingervision.tables.dialect import UNIT_BEHIND, Dialect, is_comment, is_number, is_value, split
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import Question
from fingervision.tables.units import column_name, is_unit, known_unit, spelled
from fingervision.tables.words import role_of, tokens

NAME, UNIT = "name", "unit"
CLOCK = "Time"
"""Name of the column of times before each channel."""


@dataclass(frozen=True, slots=True)
class Header:
    """The header lines above the numbers.

    Parameters
    ----------
    names : tuple of str
        Names of the columns; empty if there are none.
    units : tuple of str
        Units from a row of units; empty if there is none.
    line : int
        Number of the line with the names, from 0; -1 if there is none.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    line: int = -1


def labelled_pairs(lines: Sequence[str], dialect: Dialect) -> Header | None:
    """Read a header in which a label stands above each column of times, and its value above the column of the channel.

    Beckhoff's TwinCAT Scope exports `Name  ActPos  Name  Gap` and `Unit  mm  Unit  mm` above pairs of time and value.
    The unit of the times is not stated there.

    Parameters
    ----------
    lines : sequence of str
        Lines above the first row.
    dialect : Dialect
        Separator and number of columns.

    Returns
    -------
    Header or None
        None if no line has pairs of label and value.
    """
    if dialect.wide < 4 or dialect.wide % 2:
        return None
    found: dict[str, tuple[int, list[str]]] = {}
    for at, line in enumerate(lines):
        cells = split(line, dialect.separator)
        cells += [""] * (dialect.wide - len(cells))
        labels = {cell.lower() for cell in cells[::2]}
        if len(cells) == dialect.wide and len(labels) == 1:
            found[labels.pop()] = at, cells[1::2]
    if NAME not in found:
        return None
    line_number, channels = found[NAME]
    units = [unit if known_unit(unit) else "" for unit in found.get(UNIT, (0, [""] * len(channels)))[1]]
    names = tuple(name for channel in channels for name in (CLOCK, channel))
    return Header(names, tuple(name for unit in units for name in ("", unit)), line_number)


HEADER_LINES = 6
"""Number of lines above the numbers that are searched for names and units."""
SETTINGS_LINES = 60
"""Number of lines in which settings with as many cells as a row may stand above the column names."""
LAST_REMARK = frozenset({"", "comment", "comments", "kommentar", "bemerkung", "commentaire", "comentario", "commento"})
"""Names of a last column that may be missing in rows."""

LABEL_NAMES = frozenset({"long name", "long names"})
LABEL_UNITS = frozenset({"unit", "units", "einheit", "einheiten"})
LABEL_REMARKS = frozenset({"comment", "comments", "kommentar", "kommentare", "f(x)", "f(x)=", "sampling interval"})
"""Labels in the first column of a worksheet's header rows (ASCII export of OriginLab), above an empty column."""
COMMENTED = re.compile(
    r"^\s*(#+|%+|//+|!+)\s*((columns?|fields?|spalten|colonnes|columnas|colonne)\s*[:=]\s*)?", re.IGNORECASE
)
"""What may stand before the names in a comment: `# columns: time, position`."""
TYPES = re.compile(r"(DT_)?(DOUBLE|FLOAT|REAL|SINGLE|U?INT|INTEGER|STRING|NUMERIC|NUMBER)_?\d*", re.IGNORECASE)
"""Types of numbers, which some programs write in a row below the units."""
ONE_A_LINE = re.compile(r"\W*NAME(\d+)\s*=\s*(.*\S)\s*")
"""Pattern of a line that names a single column (data recorders of Physik Instrumente write `# NAME0 = ...`)."""


def _is_row(cells: Sequence[str], dialect: Dialect) -> bool:
    # `Points: 30` is a key and its value.
    is_key = cells[0].endswith((":", "=")) and not is_value(cells[0], dialect.decimal)
    return len(cells) == dialect.wide and not is_key and any(is_number(cell, dialect.decimal) for cell in cells)


def _is_label(cells: Sequence[str], below: Sequence[str], dialect: Dialect) -> bool:
    """Whether a line is a label with a value for each channel (`Offset 0 Offset 0`), which the next line has not."""
    if dialect.wide < 4 or len(set(cells[::2])) > 1 or is_value(cells[0], dialect.decimal):
        return False
    following = next((line for line in below if line.strip()), "")
    return split(following, dialect.separator)[:1] != cells[:1]


def _is_quantities(cells: Sequence[str], below: Sequence[str], dialect: Dialect) -> bool:
    """Whether columns are named by quantities (`5 mm`, `10 mm`), so that the cells below them have no units."""
    following = split(next((line for line in below if line.strip()), ""), dialect.separator)
    if len(following) != len(cells):
        return False
    return any(
        UNIT_BEHIND.search(cell) is not None and is_number(number, dialect.decimal) and not UNIT_BEHIND.search(number)
        for cell, number in zip(cells, following, strict=True)
    )


def first_row(lines: Sequence[str], dialect: Dialect, given: Entry) -> int:
    """Find the line number, from 0, of the first row of numbers."""
    start = 0 if given.header_line is None else min(given.header_line, len(lines))
    named = given.header_line is None
    poor: int | None = None
    for at in range(start, len(lines)):
        if is_comment(lines[at]) or not lines[at].strip():
            continue
        cells = split(lines[at], dialect.separator)
        below = lines[at + 1 :]
        if not _is_row(cells, dialect) or _is_label(cells, below, dialect) or _is_quantities(cells, below, dialect):
            continue
        # Numbers in column names are not values: the header `Position 1, Position 2` contains no value.
        values = sum(is_value(cell, dialect.decimal) for cell in cells)
        words = sum(role_of(column_name(cell).base) is not None for cell in cells)
        if not named or values > words:
            # A line such as `rate, 0.5, mm/s` above the table has as many cells as a row of three columns, and contains
            # a number.
            if not named or 2 * values >= dialect.wide:
                return at
            poor = at if poor is None else poor
    return len(lines) if poor is None else poor


def header_below_values(lines: Sequence[str], dialect: Dialect) -> int | None:
    """Number of the line with the column names, from 1, if lines above it look like rows of numbers.

    Programs write settings above the names (`Sample rate,1000,Hz`); only where nothing above the first row is a known
    name are the names looked for further down.
    """
    first = first_row(lines, dialect, Entry())
    if any(column_name(name).role is not None for name in find_header(lines, first, dialect, Entry()).names):
        return None
    for at in range(first + 1, min(len(lines) - 1, first + SETTINGS_LINES)):
        if not lines[at].strip() or is_comment(lines[at]):
            continue
        names = names_in(lines[at], dialect)
        if names is None or any(name and is_value(name, dialect.decimal) for name in names):
            continue
        if sum(column_name(name).role is not None for name in names) > 1:
            return at + 1
    return None


def find_header(lines: Sequence[str], first: int, dialect: Dialect, given: Entry) -> Header:
    """Find column names and units above the first row."""
    if given.header_line == 0:
        return Header()
    if given.header_line is not None:
        return _stated_header(lines, first, dialect, given.header_line - 1)
    for listed in (_one_a_line(lines[:first], dialect.wide), labelled_pairs(lines[:first], dialect)):
        if listed is not None:
            return listed
    found: list[tuple[int, int, tuple[str, ...]]] = []
    units, units_at = None, -1
    for at in range(first - 1, max(-1, first - 1 - HEADER_LINES), -1):
        if not lines[at].strip():
            continue
        label, labelled = _labelled(lines[at], dialect)
        if label in LABEL_NAMES:
            return Header(labelled, units or (), at)
        if label in LABEL_REMARKS and not found:
            continue
        if label in LABEL_UNITS and not found and all(is_unit(cell) for cell in labelled):
            units, units_at = labelled, at
            continue
        names = names_in(lines[at], dialect)
        if names is not None and not found and all(TYPES.fullmatch(cell) for cell in names):
            continue
        if names is None:
            if found or units:
                break
            continue
        if units is None and not found and _all_units(names):
            units, units_at = names, at
            continue
        known = sum(column_name(name).role is not None or column_name(name).source is not None for name in names)
        found.append((known, at, names))
    if found:
        # The line with the most known words is chosen; among equal lines, the line nearest to the numbers.
        _, at, names = max(found, key=lambda item: (item[0], item[1]))
        return Header(names, units or (), at)
    return _without_names(lines, first, dialect, units, units_at)


def _without_names(
    lines: Sequence[str], first: int, dialect: Dialect, units: tuple[str, ...] | None, units_at: int
) -> Header:
    """Header of a table above whose numbers there is at most a line of units."""
    if units and not all(known_unit(cell) for cell in units if cell):
        # `a,b` could mean ares and bits, but names are more probable above numbers than a line of rare units.
        return Header(units, (), units_at)
    return _names_beside_index(lines, first, dialect) or Header((), units or (), -1)


def _stated_header(lines: Sequence[str], first: int, dialect: Dialect, at: int) -> Header:
    """Column names on the line that the user states, and the units below them."""
    names = names_in(lines[at], dialect) if at < len(lines) else None
    if names is None:
        raise DataError(
            f"header_line must be the number of the line with the {dialect.wide} column names, but line {at + 1} "
            f"is '{lines[at][:80] if at < len(lines) else 'not there'}': correct it."
        )
    units = names_in(lines[at + 1], dialect) if at + 1 < first else None
    return Header(names, units if units is not None and _all_units(units) else (), at)


def _names_beside_index(lines: Sequence[str], first: int, dialect: Dialect) -> Header | None:
    """Names above all columns but the first, which numbers the rows: as R and pandas print a table."""
    if dialect.wide < 3:
        return None
    for at in range(first - 1, max(-1, first - 1 - HEADER_LINES), -1):
        names = names_in(lines[at], replace(dialect, wide=dialect.wide - 1)) if lines[at].strip() else None
        if names is None or sum(column_name(name).role is not None for name in names) < 2:
            continue
        index = [split(line, dialect.separator)[0].strip('"') for line in lines[first : first + 3] if line.strip()]
        if len(index) > 1 and all(cell.isdecimal() for cell in index):
            steps = {int(b) - int(a) for a, b in pairwise(index)}
            return Header(("", *(name.strip('"') for name in names)), (), at) if steps == {1} else None
    return None


def _labelled(line: str, dialect: Dialect) -> tuple[str, tuple[str, ...]]:
    """Label (in lower case) in the first column of the header row, and the row's value for each column."""
    label, *cells = [cell.strip() for cell in line.split("\t")]
    if len(cells) == dialect.wide - 1:
        cells = ["", *cells]
    return (label.lower().rstrip(":"), tuple(cells)) if len(cells) == dialect.wide else ("", ())


def _one_a_line(lines: Sequence[str], wide: int) -> Header | None:
    """Read column names that are listed one per line; None if not every column has a name."""
    matches = [(at, ONE_A_LINE.fullmatch(line)) for at, line in enumerate(lines)]
    found = {int(match[1]): (match[2], at) for at, match in matches if match is not None}
    if sorted(found) != list(range(wide)):
        return None
    return Header(tuple(found[k][0] for k in range(wide)), (), found[wide - 1][1])


def _all_units(cells: Sequence[str]) -> bool:
    """Whether a line contains only units and empty cells, with at least one unit."""
    # `t` can be a name or a tonne, and `s` a second: such a word is a name only if the line contains other names.
    return any(cells) and all(is_unit(cell) for cell in cells) and sum(role_of(cell) is not None for cell in cells) == 0


def names_in(line: str, dialect: Dialect) -> tuple[str, ...] | None:
    """Interpret a line as the names of all columns; None if the number of names differs from that of columns."""
    text = COMMENTED.sub("", line)
    text = text.strip() if dialect.separator is None else text.rstrip("\r\n")
    wide = dialect.wide
    for cells in _splits(text, dialect):
        if len(cells) == wide + 1 and cells[-1].strip().lower() in LAST_REMARK:
            cells = cells[:-1]
        if len(cells) != wide:
            continue
        if "=" in cells or all(is_value(cell, dialect.decimal) for cell in cells):
            return None  # the line holds a key and its value, or numbers
        return tuple(cells)
    return None


def _splits(text: str, dialect: Dialect) -> list[list[str]]:
    """List the ways in which a line can be split into names, the most probable first."""
    ways = [split(text, dialect.separator)]
    if dialect.separator is None:
        ways.append([cell.strip() for cell in re.split(r"\t+|\s{2,}", text) if cell.strip()])
        joined = re.sub(r"\s+(?=[\[(<])", "\u2007", text)
        ways.append([cell.replace("\u2007", " ") for cell in joined.split()])
        ways += [[cell.strip() for cell in text.split(mark)] for mark in (",", ";", "|")]
    elif is_comment(text) or dialect.separator != ",":
        ways.append([cell.strip() for cell in re.split(r"\t+|\s{2,}", text) if cell.strip()])
    return ways


# Lines among the rows of a text table that are no rows: the column names of a second table, and statistics.

AVERAGE_WORDS = (
    "mean average avg stdev stddev std sd variance rms mittelwert mittel standardabweichung stabw moyenne ecarttype "
    "promedio media deviazione"
)
OTHER_WORDS = "min max minimum maximum sum total median count range n summe anzahl spanne"
AVERAGES = frozenset(AVERAGE_WORDS.split())
"""Words for statistics that mark a row wherever they stand. The others may be remarks on a measured row."""
STATISTICS = AVERAGES | frozenset(OTHER_WORDS.split())


def is_other_header(cells: Sequence[str], names: Sequence[str], units: Sequence[str], decimal: str) -> bool:
    """Whether a line among the rows begins a table with other columns, or with the same columns in other units.

    Examples
    --------
    >>> names = ["Time (s)", "Position (mm)"]
    >>> is_other_header(["Time (s)", "Position (um)"], names, ["", ""], ".")
    True
    >>> is_other_header(["TIME (s)", "position [mm]"], names, ["", ""], ".")
    False
    """
    cells = [cell.strip() for cell in cells]
    if any(cell and is_value(cell, decimal) for cell in cells) or sum(map(bool, cells)) < 2:
        return False
    if any(units) and all(is_unit(cell) for cell in cells):
        return any(known_unit(a) != known_unit(b) for a, b in zip(cells, units, strict=True))
    here, above = ([column_name(cell) for cell in line] for line in (cells, names))
    roles = [name.role for name in here]
    if sum(role is not None for role in roles) < 2:
        return False
    return any(
        a.role != b.role or _unit(a.unit) != _unit(b.unit) for a, b in zip(here, above, strict=True) if a.text != b.text
    )


def _unit(text: str) -> str:
    return known_unit(text) or spelled(text)


def other_header(first: int, other: int) -> Question:
    """Question which of two tables in one file is to be read; `first` and `other` are the lines of their names."""
    return Question(
        f"line {other} has other column names or units than line {first}, so that the file holds more than one table: "
        f"header_line={first} or header_line={other} reads one of them",
        f"header_line={first}",
    )


def statistics_below(rows: Sequence[Sequence[str]]) -> int:
    """Number of rows at the end of a table that hold statistics of the rows above, such as their mean.

    Examples
    --------
    >>> statistics_below([["0.1", "0.6", ""], ["0.2", "0.7", "max"], ["Mean", "0.65", ""], ["Std. dev.", "0.05", ""]])
    2
    """
    count = 0
    while count < len(rows) and _is_statistics(rows[-1 - count]):
        count += 1
    return count


def _is_statistics(row: Sequence[str]) -> bool:
    words = ["".join(tokens(cell)) for cell in row]
    return words[0] in STATISTICS or any(word in AVERAGES for word in words)

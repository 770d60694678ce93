"""Text tables in which each line holds a column."""

from collections.abc import Sequence

from fingervision.tables.column_names import column_name
from fingervision.tables.dialect import Dialect, is_comment, is_value, split

MOST_LINES = 12
"""Largest number of lines of a table with one column per line, and smallest ratio of its columns to its lines."""
LEAST_RATIO = 3


def exchanged(lines: Sequence[str], dialect: Dialect) -> list[str] | None:
    """Exchange rows and columns if each line is a name of a known role and many numbers; None for any other table."""
    if dialect.separator is None:
        return None
    told = [line for line in lines[: 2 * MOST_LINES] if line.strip() and not is_comment(line)]
    cells = [split(line, dialect.separator) for line in told]
    if not 2 <= len(cells) <= MOST_LINES or len(lines) > 2 * MOST_LINES:
        return None
    wide = dialect.wide
    if wide < LEAST_RATIO * len(cells) or any(len(row) != wide for row in cells):
        return None
    if any(not all(is_value(cell, dialect.decimal) for cell in row[1:]) for row in cells):
        return None
    if sum(column_name(row[0]).role is not None for row in cells) < 2:
        return None
    return [dialect.separator.join(column) for column in zip(*cells, strict=True)]

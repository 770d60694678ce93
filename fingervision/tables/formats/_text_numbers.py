"""Numbers that a workbook stores as text, as it does for values pasted or imported in another locale."""

from collections.abc import Sequence
from pathlib import Path

from fingervision.tables.cells import which_mark
from fingervision.tables.dialect import THOUSANDS, is_number
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError


def is_number_text(cell: object) -> bool:
    """Whether a cell holds a number as text, with either decimal mark.

    Examples
    --------
    >>> is_number_text("0,61"), is_number_text("0.61"), is_number_text("Gap"), is_number_text(0.61)
    (True, True, False, False)
    """
    return isinstance(cell, str) and any(is_number(cell.strip(), mark) for mark in ".,")


def decimal_of_texts(path: Path, rows: Sequence[Sequence[object]], given: Entry) -> str:
    """Decimal mark of the numbers that are stored as text; a point if there are none.

    Raises
    ------
    OpenQuestionError
        Each comma may be a decimal mark or separate thousands.
    """
    if "decimal" in given.words:
        return given.words["decimal"]
    marked = [text for row in rows for cell in row if isinstance(cell, str) and "," in (text := cell.strip())]
    commas = [text for text in marked if is_number(text, ",")]
    if not commas:
        return "."
    if all(THOUSANDS[","].fullmatch(text) for text in commas):
        raise OpenQuestionError(path, "table", [which_mark(commas)])
    return ","

"""Convert cells of text to numbers, with the decimal mark of their table."""

from collections.abc import Sequence
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.numbers import to_number
from fingervision.storage.number_columns import Numbers
from fingervision.tables.dialect import MISSING, THOUSANDS
from fingervision.tables.questions import Question, Reading, asked, span


def to_numbers(cells: Sequence[str], decimal: str) -> tuple[Numbers, NDArray[np.intp]]:
    """Read cells as numbers.

    Parameters
    ----------
    cells : sequence of str, length n
        Cells without surrounding white space.
    decimal : str
        Decimal mark: `.` or `,`.

    Returns
    -------
    Numbers
        Numbers of length n; cells without a number are marked as missing.
    ndarray of int
        Rows whose cell is neither a number nor a usual word for a missing value.
    """
    try:
        dotted = [cell for cell in cells if "." in cell] if decimal == "," else []
        # Beside decimal commas in other columns, `1.000` is a thousand; a column with `0.500` has decimal points.
        grouped = bool(dotted) and all(THOUSANDS["."].fullmatch(cell) for cell in dotted)
        if decimal == "," and (grouped or any("," in cell for cell in cells)):
            if dotted:
                raise ValueError  # noqa: TRY301 - points would be read as decimal points: the cells are read one by one
            value = np.array([float(cell.replace(",", ".")) for cell in cells], dtype=np.float64)
        else:
            value = np.array(list(map(float, cells)), dtype=np.float64)
        if np.all(np.isfinite(value)):
            return Numbers.whole(value), np.zeros(0, dtype=np.intp)
    except ValueError:
        pass
    value, present = np.zeros(len(cells)), np.zeros(len(cells), dtype=np.bool_)
    odd = []
    for row, cell in enumerate(cells):
        number: float | None
        try:
            number = float(cell) if decimal == "." else float(cell.replace(",", ".") if "." not in cell else "?")
        except ValueError:
            number = to_number(cell, decimal)
        if number is not None and isfinite(number):
            value[row], present[row] = number, True
        elif cell.strip().lower() not in MISSING:
            odd.append(row)
    return Numbers(value, present), np.array(odd, dtype=np.intp)


def which_mark(cells: Sequence[str]) -> Question:
    """Question whether the only mark in numbers is the decimal sign or separates thousands."""
    marked = [cell for cell in cells if any(mark in cell and THOUSANDS[mark].fullmatch(cell) for mark in ",.")]
    mark, other, name = (",", ".", "comma") if "," in marked[0] else (".", ",", "point")
    readings = [
        Reading(f"decimal={sign}", f"'{marked[0]}' is {to_number(marked[0], sign):g}, and all such numbers are "
                f"{span(to_numbers(marked, sign)[0].value)}")
        for sign in (mark, other)
    ]  # fmt: skip
    return asked(f"each {name} in the numbers may be the decimal sign or a thousands separator", readings)

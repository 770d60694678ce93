"""Summary of one result for the overview: a table row and a small plot."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Cell = str | float | int | None
CURVE_POINTS = 48
"""Number of points in a small plot, whose width is about 150 px; a page with ten thousand small plots then has a few
MB."""


@dataclass(frozen=True, slots=True)
class Digest:
    """Summary of one result.

    Parameters
    ----------
    cells : mapping of str to text, number or None
        Cells of the result's table row, by column.
    curve : tuple of float or None
        At most `CURVE_POINTS` evenly spaced values for the small plot; None for a missing value.
    caption : str
        Short caption of the plot.
    """

    cells: Mapping[str, Cell]
    curve: tuple[float | None, ...]
    caption: str


def thinned(values: NDArray[np.float64]) -> tuple[float | None, ...]:
    """Select evenly spaced elements of an array, rounded to five significant digits.

    Parameters
    ----------
    values : ndarray of float, shape (n,)
        Values; NaN for a missing value.
    """
    if values.size > CURVE_POINTS:
        values = values[np.linspace(0, values.size - 1, CURVE_POINTS).round().astype(np.int64)]
    return tuple(float(f"{value:.5g}") if np.isfinite(value) else None for value in values.tolist())

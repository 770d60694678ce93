"""Plot of a curve in characters, for a terminal."""

import numpy as np
from numpy.typing import NDArray

WIDE, HIGH = 56, 10
"""Width and height of the plot in characters; a braille character has two by four dots."""
DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
EMPTY = 0x2800
FINEST = 1e-12
FEW, JOINED = 2000, 20_000


def terminal_plot(
    x_name: str, x: NDArray[np.float64], y_name: str, y: NDArray[np.float64], *, plain: bool = False
) -> list[str]:
    """Plot points in a grid of characters.

    Parameters
    ----------
    x_name, y_name : str
        Labels of the axes.
    x, y : ndarray of float, shape (n,)
        Coordinates of the points, n at least 1.
    plain : bool
        Whether to use asterisks instead of braille characters, for terminals without Unicode.
    """
    top, bottom = f"{np.max(y):.4g}", f"{np.min(y):.4g}"
    left, right = f"{np.min(x):.4g}", f"{np.max(x):.4g}"
    if x.size <= FEW:
        # If there are few points, they are joined by lines, so that the curve is visible.
        at = np.linspace(0.0, x.size - 1.0, JOINED)
        x, y = (np.interp(at, np.arange(x.size), values) for values in (x, y))
    columns, rows = (WIDE, HIGH) if plain else (2 * WIDE, 4 * HIGH)
    across = _place(x, columns)
    down = rows - 1 - _place(y, rows)
    if plain:
        marks = np.full((HIGH, WIDE), " ")
        marks[down, across] = "*"
        lines = ["".join(row) for row in marks]
    else:
        codes = np.full((HIGH, WIDE), EMPTY)
        np.bitwise_or.at(codes, (down // 4, across // 2), DOTS[down % 4, across % 2])
        lines = ["".join(map(chr, row)) for row in codes]
    margin = max(len(top), len(bottom), 4)
    labels = [top, *[""] * (HIGH - 2), bottom]
    drawn = [f"{label:>{margin}} |{line}" for label, line in zip(labels, lines, strict=True)]
    middle = x_name.center(WIDE - len(left) - len(right))
    return [f"{'':>{margin}} {y_name}", *drawn, f"{'':>{margin}}  {left}{middle}{right}"]


def _place(values: NDArray[np.float64], cells: int) -> NDArray[np.intp]:
    span = float(np.ptp(values))
    if span < FINEST:
        return np.full(values.size, cells // 2)
    places: NDArray[np.intp] = np.minimum(((values - values.min()) / span * cells).astype(np.intp), cells - 1)
    return places

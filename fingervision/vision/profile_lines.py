"""Where to look for edges: a row across a flank, a column across a tip, for every pixel of the coarse outline.

Each finger has the same number of places for lines, so that the lines of many fingers are one array: rows across the
inner flank, rows across the outer flank, columns across the tip. A place that nothing fills has no weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.fingers import CoarseFinger

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Places for each side of a finger. A longer side is thinned out.
INNER, OUTER, TIP = 72, 20, 76
ROWS = INNER + OUTER
PLACES = ROWS + TIP
IS_ROW = np.arange(PLACES) < ROWS
IS_INNER = np.arange(PLACES) < INNER
# 0 inner flank, 1 tip, 2 outer flank.
SIDE = np.where(IS_ROW, np.where(IS_INNER, 0, 2), 1)
# Outline slopes are taken over so many rows or columns to either side.
SLOPE_REACH_PX = 4


@dataclass(frozen=True, slots=True, eq=False)
class ProfileLines:
    """Lines of pixels across the outlines of fingers; arrays of shape (fingers, PLACES) unless said otherwise.

    Coordinates are the fingers' axes (across, along).

    Parameters
    ----------
    fixed : ndarray of int
        The row (of a flank) or column (of a tip).
    coarse : ndarray of int
        The finger's last pixel on that line.
    slope : ndarray of float
        Change of the edge per row or column.
    weight : ndarray of float
        1 for a line, 0 for a place that nothing fills.
    outward : ndarray of int
        +1 or -1: the sense in which the line leaves the finger.
    """

    fixed: Ints
    coarse: Ints
    slope: Floats
    weight: Floats
    outward: Ints


def profile_lines(fingers: Sequence[CoarseFinger]) -> ProfileLines:
    """Lines across the fingers' outlines, each outline pixel belonging to one line only."""
    count = len(fingers)
    fixed, coarse = np.zeros((2, count, PLACES), dtype=np.intp)
    slope, weight = np.zeros((2, count, PLACES))
    outward = np.full((count, PLACES), -1, dtype=np.intp)
    for k, finger in enumerate(fingers):
        across, along = finger.outline[:, 0], finger.outline[:, 1]
        crest = int(along.argmin())
        sign = finger.inner_sign
        outward[k, :INNER] = sign
        outward[k, INNER:ROWS] = -sign
        sides = (
            (0, INNER, along[: crest + 1], across[: crest + 1], sign, 1.0),
            (INNER, OUTER, along[crest:], across[crest:], -sign, 1.0),
            (ROWS, TIP, across, along, -1, SLOPE_OF_A_TIP),
        )
        for first, places, lines, values, sense, steepest in sides:
            # A tip is thinned out from its inner side, so that a mirrored finger has the mirrored lines.
            from_end = first == ROWS and sign > 0
            at, edge, change = _side(lines, values, sense, steepest, places, -1 if from_end else 1)
            own = slice(first, first + len(at))
            fixed[k, own], coarse[k, own], slope[k, own], weight[k, own] = at, edge, change, 1.0
    return ProfileLines(fixed, coarse, slope, weight, outward)


# Just below 45 degrees, so that no piece of the outline is seen both in rows and in columns.
SLOPE_OF_A_TIP = 0.999


def _side(lines: Ints, values: Ints, sense: int, steepest: float, places: int, order: int) -> tuple[Ints, Ints, Floats]:
    """The outermost pixel on every line that meets the outline steeply enough, its slope, thinned to the places."""
    first = int(lines.min())
    count = int(lines.max()) - first + 1
    reach = np.full(count, -(10**9))
    np.maximum.at(reach, lines - first, sense * values)
    index = np.arange(count)
    low, high = np.maximum(index - SLOPE_REACH_PX, 0), np.minimum(index + SLOPE_REACH_PX, count - 1)
    slope = sense * (reach[high] - reach[low]) / np.maximum(high - low, 1)
    keep = np.flatnonzero(np.abs(slope) <= steepest)
    keep = keep[::order][:: -(-len(keep) // places) or 1]
    return keep + first, sense * reach[keep], slope[keep]

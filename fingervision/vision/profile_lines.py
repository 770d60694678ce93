"""Search lines for edges: for every pixel of the coarse outline, a row across a flank or a column across a tip.

Each finger has the same number of array entries for lines, so that the lines of several fingers fit into one array:
rows across the inner flank, rows across the outer flank, columns across the tip. An unused entry has weight zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.fingers import CoarseFinger

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Number of array entries for each side of a finger; longer sides are thinned out.
INNER, OUTER, TIP = 72, 20, 76
ROWS = INNER + OUTER
PLACES = ROWS + TIP
IS_ROW = np.arange(PLACES) < ROWS
IS_INNER = np.arange(PLACES) < INNER
# Sides of a finger, and the side to which each array entry belongs.
INNER_SIDE, TIP_SIDE, OUTER_SIDE = range(3)
SIDE = np.where(IS_ROW, np.where(IS_INNER, INNER_SIDE, OUTER_SIDE), TIP_SIDE)
# Number of rows or columns on either side over which slopes of the outline are computed.
SLOPE_REACH_PX = 4
# Slope of a tip just below 45 degrees, so that no part of the outline is used both in rows and in columns.
SLOPE_OF_A_TIP = 0.999
# Coordinate beyond every picture (pixels).
FAR = 10**9

_fill = loop("profile_lines_fill")


@dataclass(frozen=True, slots=True, eq=False)
class ProfileLines:
    """Lines of pixels across the outlines of fingers; arrays of shape (fingers, PLACES) unless stated otherwise.

    Coordinates are given in the fingers' axes (across, along).

    Parameters
    ----------
    fixed : ndarray of int
        Row number of a line across a flank, or column number of a line across a tip.
    coarse : ndarray of int
        The finger's last pixel on that line.
    slope : ndarray of float
        Change of the edge's position per row or column.
    weight : ndarray of float
        1 for a line, 0 for an unused entry.
    outward : ndarray of int
        Direction (+1 or -1) in which the line leaves the finger.
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
        outward[k, :INNER], outward[k, INNER:ROWS] = finger.inner_sign, -finger.inner_sign
        _fill(finger.outline, finger.inner_sign, fixed[k], coarse[k], slope[k], weight[k])
    return ProfileLines(fixed, coarse, slope, weight, outward)

"""Where to look for edges: a row across a flank, a column across a tip, for every pixel of the coarse outline.

Each finger has the same number of places for lines, so that the lines of many fingers are one array: rows across the
inner flank, rows across the outer flank, columns across the tip. A place that nothing fills has no weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.fingers import CoarseFinger
from fingervision.vision.outlines import Outline

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Places for each side of a finger. A longer side is thinned out.
INNER, OUTER, TIP = 72, 20, 76
ROWS = INNER + OUTER
PLACES = ROWS + TIP
IS_ROW = np.arange(PLACES) < ROWS
IS_INNER = np.arange(PLACES) < INNER
# The sides of a finger, and which one each place belongs to.
INNER_SIDE, TIP_SIDE, OUTER_SIDE = range(3)
SIDE = np.where(IS_ROW, np.where(IS_INNER, INNER_SIDE, OUTER_SIDE), TIP_SIDE)
# Outline slopes are taken over so many rows or columns to either side.
SLOPE_REACH_PX = 4
# Just below 45 degrees, so that no piece of the outline is seen both in rows and in columns.
SLOPE_OF_A_TIP = 0.999
# Beyond every picture (pixels).
FAR = 10**9


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
        outward[k, :INNER], outward[k, INNER:ROWS] = finger.inner_sign, -finger.inner_sign
        _fill(finger.outline, finger.inner_sign, fixed[k], coarse[k], slope[k], weight[k])
    return ProfileLines(fixed, coarse, slope, weight, outward)


@compiled
def _fill(outline: Outline, inner_sign: int, fixed: Ints, coarse: Ints, slope: Floats, weight: Floats) -> None:
    """Put the lines of one finger into their places."""
    across, along = outline[:, 0], outline[:, 1]
    crest = along.argmin()
    for side in range(3):
        if side == 0:
            first, past, sense, steepest = 0, INNER, inner_sign, 1.0
            lines, values = along[: crest + 1], across[: crest + 1]
        elif side == 1:
            first, past, sense, steepest = INNER, ROWS, -inner_sign, 1.0
            lines, values = along[crest:], across[crest:]
        else:
            first, past, sense, steepest = ROWS, PLACES, -1, SLOPE_OF_A_TIP
            lines, values = across, along
        lowest = lines.min()
        reach = np.full(lines.max() - lowest + 1, -FAR)
        for i in range(lines.size):
            reach[lines[i] - lowest] = max(reach[lines[i] - lowest], sense * values[i])
        change = np.empty(reach.size)
        keep, kept = np.empty(reach.size, dtype=np.int64), 0
        for i in range(reach.size):
            low, high = max(i - SLOPE_REACH_PX, 0), min(i + SLOPE_REACH_PX, reach.size - 1)
            change[i] = sense * (reach[high] - reach[low]) / max(high - low, 1)
            if abs(change[i]) <= steepest:
                keep[kept] = i
                kept += 1
        thinning = -(-kept // (past - first))
        place = first
        for n in range(0, kept, max(thinning, 1)):
            # A tip is thinned out from its inner side, so that a mirrored finger has the mirrored lines.
            # Flanks that are thinned out have even and odd rows all the same: an interlaced picture's two fields.
            other = 1 if side < 2 and thinning % 2 == 0 and (place - first) % 2 == 1 and n + 1 < kept else 0
            i = keep[kept - 1 - n] if side == 2 and inner_sign > 0 else keep[n + other]
            fixed[place], coarse[place], slope[place], weight[place] = i + lowest, sense * reach[i], change[i], 1.0
            place += 1

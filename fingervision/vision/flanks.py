"""The flanks of a thing, to a pixel: whether they are straight for a good part of their length, as a finger's are."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.median import middle
from fingervision.vision.outlines import Outline
from fingervision.vision.tops import Top

# An outline that comes back up by more than this has passed the bottom of a notch; dust on a finger makes smaller ones.
TURNED_PX = 5
# A finger's flank is straight over so many times the measuring height and so much of its length.
LEAST_HEIGHTS, LEAST_SHARE = 3.0, 0.25
# A straight flank leans by no more than this (10 degrees of tilt and a taper), has so many of its rows within so many
# pixels of a line, and its middle third off that line by no more than so much: binary outlines are good to this.
STEEPEST, MOST_OFF, OFF_PX, BOW_PX = 0.3, 0.25, 1.5, 0.25
# A stretch is looked at in so many rows, and the next one begins so much of its length below.
ROWS_IN_A_THIRD, STRETCHES = 16, 8


def has_straight_flanks(top: Top, below_tip_px: float, steepest: float = STEEPEST) -> bool:
    """Whether what begins at a top goes down between straight flanks.

    A side that ends in a notch before it is as long as is asked speaks neither for nor against it.

    Parameters
    ----------
    top : Top
        Where the thing begins.
    below_tip_px : float
        Height of measuring below the tips.
    steepest : float
        Pixels across per pixel along by which a flank may lean.
    """
    sides = [across_by_row(top.outline, top.index, step) for step in (-1, 1)]
    wanted = int(max(LEAST_HEIGHTS * below_tip_px, LEAST_SHARE * max(side.size for side in sides)))
    long = [side for side in sides if side.size >= wanted]
    return bool(long) and all(_has_straight_stretch(side, wanted, steepest) for side in long)


@compiled
def follow_down(outline: Outline, top: int, step: int, limit: float) -> int:
    """Where the outline, followed from its top, has gone down to `limit`, or was lowest before it turned back up."""
    end, i = top, top
    while 0 <= i < outline.shape[0] and outline[end, 1] < limit and outline[end, 1] - outline[i, 1] <= TURNED_PX:
        if outline[i, 1] > outline[end, 1]:
            end = i
        i += step
    return end


@compiled
def across_by_row(outline: Outline, top: int, step: int) -> NDArray[np.float64]:
    """Where the outline, followed down from its top, last crosses every row, from the top's own on."""
    end = follow_down(outline, top, step, np.inf)
    across = np.zeros(outline[end, 1] - outline[top, 1] + 1)
    i = top
    while i != end + step:
        across[outline[i, 1] - outline[top, 1]] = outline[i, 0]
        i += step
    return across


@compiled
def _has_straight_stretch(across: NDArray[np.float64], length: int, steepest: float) -> bool:
    """Whether any stretch of so many rows is straight."""
    third = length // 3
    stride = max(third // ROWS_IN_A_THIRD, 1)
    for start in range(0, across.size - length + 1, max(length // STRETCHES, 1)):
        a, b, c = start, start + third, start + 2 * third
        first, last = middle(across[a:b:stride]), middle(across[c : c + third : stride])
        slope = (last - first) / (2.0 * third)
        if abs(slope) > steepest:
            continue
        off, rows = 0, 0
        means = np.zeros(3)
        for k in range(3):
            count = 0
            for row in range(start + k * third, start + (k + 1) * third, stride):
                away = across[row] - first - slope * (row - a - 0.5 * third)
                rows += 1
                if abs(away) > OFF_PX:
                    off += 1
                else:
                    means[k] += away
                    count += 1
            means[k] /= max(count, 1)
        if off <= MOST_OFF * rows and abs(means[1] - 0.5 * (means[0] + means[2])) <= BOW_PX:
            return True
    return False

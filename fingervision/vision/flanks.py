"""Flanks of an object to the nearest pixel: whether they are straight over a sufficient length, as a finger's are."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.outlines import Outline
from fingervision.vision.tops import Top

# Rise of an outline (pixels) above which it has passed the bottom of a notch; dust on a finger causes a smaller rise.
TURNED_PX = 5
# Least straight length of a finger's flank, as a multiple of the measuring height and as a share of the finger's
# length.
LEAST_HEIGHTS, LEAST_SHARE = 3.0, 0.25
# Limits of a straight flank: inclination (10 degrees of tilt and a taper); share of rows that may be farther than this
# distance (pixels) from a line; distance of the middle third from the line, relative to the accuracy of binary
# outlines.
STEEPEST, MOST_OFF, OFF_PX, BOW_PX = 0.3, 0.25, 1.5, 0.25
# Number of rows in each third of a stretch, and number of stretches.
ROWS_IN_A_THIRD, STRETCHES = 16, 8

_follow_down = loop("flanks_follow_down")
_across_by_row = loop("flanks_across_by_row")
_has_straight_stretch = loop("flanks_has_straight_stretch")


def has_straight_flanks(top: Top, below_tip_px: float, steepest: float = STEEPEST) -> bool:
    """Whether the object below a local maximum has straight flanks.

    A side that ends in a notch before the required length is ignored.

    Parameters
    ----------
    top : Top
        Local maximum of the object's outline.
    below_tip_px : float
        Distance of the measuring point below the tip.
    steepest : float
        Largest inclination of a flank, in pixels across per pixel along the finger.
    """
    sides = [across_by_row(top.outline, top.index, step) for step in (-1, 1)]
    wanted = int(max(LEAST_HEIGHTS * below_tip_px, LEAST_SHARE * max(side.size for side in sides)))
    long = [side for side in sides if side.size >= wanted]
    return bool(long) and all(_has_straight_stretch(side, wanted, steepest) for side in long)


def follow_down(outline: Outline, top: int, step: int, limit: float) -> int:
    """Index at which the outline, followed down from its tip, reaches `limit`, or its lowest point if that is first."""
    end, _ = _follow_down(outline, top, step, limit)
    return int(end)


def across_by_row(outline: Outline, top: int, step: int) -> NDArray[np.float64]:
    """Position across the finger at each row, where the outline, followed down from the tip, last crosses that row."""
    end, deep = _follow_down(outline, top, step, np.inf)
    across = np.empty(deep + 1)
    _across_by_row(outline, top, step, end, across)
    return across

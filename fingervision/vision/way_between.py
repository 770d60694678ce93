"""The way from one finger to the other at the measuring height: nothing but ground, and dust."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.outlines import Outline

# (x, y) in the picture.
Place = tuple[float, float]

# Dust covers no more than so much of the way from one finger to the other.
DUST_SHARE = 0.25
# The way begins so many pixels away from each finger.
END_PX = 3


def is_free(mask: NDArray[np.uint8], start: Place, end: Place) -> bool:
    """Whether next to nothing is set in a mask on the straight way from one place to another."""
    return _covered(mask, *start, *end) <= DUST_SHARE


@compiled
def inner_crossing(outline: Outline, height: float) -> tuple[float, float]:
    """Where the outline of a finger, its inner side first, rises past a height: (across, along)."""
    i = 0
    while i < outline.shape[0] - 1 and outline[i, 1] > height:
        i += 1
    return float(outline[i, 0]), float(outline[i, 1])


@compiled
def _covered(mask: NDArray[np.uint8], x0: float, y0: float, x1: float, y1: float) -> float:
    """Share of the way that is set in the mask, but for its two ends."""
    steps = int(max(abs(x1 - x0), abs(y1 - y0)))
    covered, counted = 0, 0
    for k in range(END_PX, steps - END_PX + 1):
        x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
        counted += 1
        if mask[int(np.rint(y)), int(np.rint(x))]:
            covered += 1
    return covered / max(counted, 1)

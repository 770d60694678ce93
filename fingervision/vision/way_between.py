"""Check that only background and dust lie between the fingers at the measuring height."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.outlines import Outline

# Position (x, y) in the picture.
Place = tuple[float, float]

# Largest share of the path from one finger to the other that dust may cover.
DUST_SHARE = 0.25
# Distance from each finger at which the path begins (pixels).
END_PX = 3

_inner_crossing = loop("way_between_inner_crossing")
_covered = loop("way_between_covered")


def is_free(mask: NDArray[np.uint8], start: Place, end: Place) -> bool:
    """Whether the straight path between two positions is almost free of the mask's objects."""
    return float(_covered(mask, *start, *end)) <= DUST_SHARE


def inner_crossing(outline: Outline, height: float) -> tuple[float, float]:
    """Position (across, along) at which a finger's outline, followed from its inner side, first exceeds a height."""
    across, along = _inner_crossing(outline, height)
    return across, along

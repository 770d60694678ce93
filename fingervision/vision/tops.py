"""Candidates of finger tips: local maxima of the outlines, and the prominence of each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.orientation import Orientation
from fingervision.vision.outlines import Outline, Outlines, in_axes

# Least prominence of a local maximum (pixels); smaller maxima are noise or dust on an outline.
SMALLEST_PROMINENCE_PX = 5.0
# Largest number of local maxima; the fingers are among the most prominent maxima.
MOST_TOPS = 8

_find_tops = loop("tops_find")


@dataclass(frozen=True, slots=True, eq=False)
class Top:
    """A local maximum of an outline, in the direction in which the tips point.

    Parameters
    ----------
    outline : ndarray of int32, shape (n, 2)
        Closed outline of the object, (across, along), starting at its lowest point.
    index : int
        Index of the maximum in the outline.
    prominence_px : float
        Topographic prominence: drop from the maximum to the end of the object, or to the saddle towards a higher
        maximum.
    is_rooted : bool
        Whether the object reaches the border of the picture on the side away from the tips.
    """

    outline: Outline
    index: int
    prominence_px: float
    is_rooted: bool

    @property
    def across_px(self) -> int:
        """Coordinate across the fingers."""
        return int(self.outline[self.index, 0])

    @property
    def along_px(self) -> int:
        """Coordinate along the fingers."""
        return int(self.outline[self.index, 1])


def find_tops(mask: NDArray[np.uint8], outlines: Outlines, orientation: Orientation) -> list[Top]:
    """Find the local maxima of all outlines with the largest prominence, in falling order, at most `MOST_TOPS`."""
    outline, index, prominence = np.empty((3, MOST_TOPS), dtype=np.int64)
    is_rooted = np.empty(MOST_TOPS, dtype=np.bool_)
    way = (orientation.direction.is_vertical, orientation.is_flipped, orientation.along_size)
    count = _find_tops(
        orientation.view(mask), outlines.points, outlines.starts, *way, outline, index, prominence, is_rooted
    )
    seen: dict[int, Outline] = {}
    found = []
    for k in range(count):
        number = int(outline[k])
        if number not in seen:
            seen[number] = in_axes(outlines[number], orientation)
        found.append(Top(seen[number], int(index[k]), float(prominence[k]), bool(is_rooted[k])))
    return found

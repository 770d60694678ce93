"""Where something begins, seen from the tips' side: the local tops of the outlines and how far each goes down."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.orientation import Orientation
from fingervision.vision.outlines import Outline, in_axes

# A top that is lower than this is noise or dust on an outline, whatever the scale (pixels).
SMALLEST_PROMINENCE_PX = 5.0

_find_peaks = loop("tops_peaks")


@dataclass(frozen=True, slots=True, eq=False)
class Top:
    """A place where something begins, seen from the tips' side.

    Parameters
    ----------
    outline : ndarray of int32, shape (n, 2)
        Closed outline of the thing, (across, along), starting at its lowest point.
    index : int
        Place of the top on the outline.
    prominence_px : float
        How far it goes down before it ends or meets a higher top.
    is_rooted : bool
        Whether it goes down as far as the picture does.
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


def find_tops(mask: NDArray[np.uint8], outlines: list[Outline], orientation: Orientation) -> list[Top]:
    """The tops of all outlines, the most prominent first."""
    upright, deepest = orientation.view(mask), orientation.along_size - 1
    found = []
    for pixels in outlines:
        outline = in_axes(pixels, orientation)
        bottom = int(outline[0, 1])
        start, peaks, prominences = np.empty((3, len(outline)), dtype=np.int64)
        count = _find_peaks(outline, start, peaks, prominences)
        for first, peak, prominence in zip(*(a[:count].tolist() for a in (start, peaks, prominences)), strict=True):
            r, middle = int(outline[peak, 1]), (int(outline[first, 0]) + int(outline[peak, 0])) // 2
            if not upright[min(r + 2, deepest), middle]:
                continue  # the top of a hole, not of a thing
            is_rooted = bottom == deepest and prominence > 0.5 * (bottom - r)
            found.append(Top(outline, peak, float(prominence), is_rooted))
    return sorted(found, key=lambda top: -top.prominence_px)

"""The two fingers of a picture, located to the nearest pixel."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.orientation import Orientation
from fingervision.vision.outlines import Outline
from fingervision.vision.tops import Top

NOTHING_HIDDEN: NDArray[np.int64] = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class CoarseFinger:
    """A finger's outline to the nearest pixel, ordered from its inner side over the tip to its outer side.

    Parameters
    ----------
    outline : ndarray of int32, shape (n, 2)
        Coordinates (across, along) of the outermost pixels that belong to the finger.
    inner_sign : int
        +1 where the gap lies at larger `across` (the left finger), -1 for the right finger.
    top : Top
        Local maximum of the outline that forms the finger's tip.
    hidden : ndarray of int64, shape (n,)
        Coordinates along the finger, in order, at which a part between the fingers hides the inner side.
    """

    outline: Outline
    inner_sign: int
    top: Top
    hidden: NDArray[np.int64] = field(default_factory=lambda: NOTHING_HIDDEN)

    @property
    def top_along_px(self) -> int:
        """Coordinate of the outermost pixel along the fingers."""
        return self.top.along_px


@dataclass(frozen=True, slots=True, eq=False)
class CoarseFingers:
    """The two fingers, located to the nearest pixel.

    Parameters
    ----------
    left, right : CoarseFinger
        Fingers with the smaller and the larger coordinate across.
    orientation : Orientation
        Axes in which the coordinates are given.
    score : float
        Degree to which the objects look like two fingers; larger is better.
    is_rooted : bool
        Whether both fingers extend to the border of the picture.
    are_cut : bool
        Whether the picture's border cuts off the outer sides of both fingers.
    held_along_px : float or None
        Coordinate along the fingers at which they hold a part; None without a part.
    are_long : bool
        Whether the outlines were followed far down, because the edges are rough.
    """

    left: CoarseFinger
    right: CoarseFinger
    orientation: Orientation
    score: float
    is_rooted: bool
    are_cut: bool
    held_along_px: float | None = None
    are_long: bool = False

    @property
    def is_joined(self) -> bool:
        """Whether the base that joins the two fingers is in view."""
        return self.left.top.outline is self.right.top.outline


def is_hidden(finger: CoarseFinger, along: float) -> bool:
    """Whether a part hides a finger's inner edge at a height along the fingers."""
    return bool(finger.hidden.size) and bool(np.isin(round(along), finger.hidden))

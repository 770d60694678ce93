"""The two fingers of a picture, located to one pixel."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.orientation import Orientation
from fingervision.vision.outlines import Outline
from fingervision.vision.tops import Top

NOTHING_HIDDEN: NDArray[np.int64] = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class CoarseFinger:
    """A finger's outline to one pixel, ordered from its inner side over the tip to its outer side.

    Parameters
    ----------
    outline : ndarray of int32, shape (n, 2)
        (across, along), the last pixels of the finger itself.
    inner_sign : int
        +1 where the gap lies at larger `across` (the left finger), -1 for the right finger.
    top : Top
        Where it begins.
    hidden : ndarray of int64, shape (n,)
        Coordinates along, in order, in which a part between the fingers hides the inner side.
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
    """The two fingers, located to one pixel.

    Parameters
    ----------
    left, right : CoarseFinger
        Smaller and larger coordinate across.
    orientation : Orientation
        The axes that they are given in.
    score : float
        How much they look like two fingers; larger is better.
    is_rooted : bool
        Whether both go down as far as the picture does.
    are_cut : bool
        Whether the picture's border cuts off the outer sides of both.
    held_along_px : float or None
        Where along the fingers both hold a part.
    """

    left: CoarseFinger
    right: CoarseFinger
    orientation: Orientation
    score: float
    is_rooted: bool
    are_cut: bool
    held_along_px: float | None = None

    @property
    def is_joined(self) -> bool:
        """Whether a common base of the two fingers is in view."""
        return self.left.top.outline is self.right.top.outline


def is_hidden(finger: CoarseFinger, along: float) -> bool:
    """Whether a part hides a finger's inner edge at a height along the fingers."""
    return bool(finger.hidden.size) and bool(np.isin(round(along), finger.hidden))

"""Step 4, the boundary of the fingers: which two of everything in view they are, and where they point.

A finger is a place where the outline, followed from the tips' side of the picture, begins: a local top that goes on
downwards for some way before it ends or meets another (topographic prominence). Two fingers that touch are one blob
with two tops and a notch between them, and are found in the same way. What begins at the picture's own border has its
tip out of view.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.vision.orientation import Orientation

Outline = NDArray[np.int_]

# A top that is lower than this is noise or dust on an outline, whatever the scale (pixels).
SMALLEST_PROMINENCE_PX = 5.0
# An outline that comes back up by more than this has passed the bottom of a notch.
SMALLEST_NOTCH_PX = 3
# Two tops with a notch between them are touching fingers where the notch has so much of the measuring height, and the
# fingers so many times of it.
SMALLEST_NOTCH_SHARE, LEAST_LENGTH_SHARE = 0.3, 4.0
# Tops beyond this number are texture; the fingers are among the most prominent.
MOST_TOPS = 8
# Fingers come in from the picture's border; things that lie in view are less likely to be fingers.
ROOTED_BONUS = 2.0
# A lone finger that comes in from the border for so many times the measuring height makes everything else a thing.
ROOTED_HEIGHTS = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Top:
    """A place where something begins, seen from the tips' side.

    Parameters
    ----------
    outline : ndarray of int, shape (n, 2)
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


@dataclass(frozen=True, slots=True, eq=False)
class CoarseFinger:
    """A finger's outline to a pixel, in order from its inner side over the tip to its outer side.

    Parameters
    ----------
    outline : ndarray of int, shape (n, 2)
        (across, along), the last pixels of the finger itself.
    inner_sign : int
        +1 where the gap lies at larger `across` (the left finger), -1 for the right finger.
    top_along_px : int
        The outermost pixel.
    """

    outline: Outline
    inner_sign: int
    top_along_px: int


@dataclass(frozen=True, slots=True, eq=False)
class CoarseFingers:
    """The two fingers, to a pixel.

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
    """

    left: CoarseFinger
    right: CoarseFinger
    orientation: Orientation
    score: float
    is_rooted: bool


def find_outlines(mask: NDArray[np.uint8]) -> list[Outline]:
    """Outlines (x, y) of everything set in a mask, holes included, but for specks."""
    outlines, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return [
        np.asarray(outline[:, 0, :], dtype=np.int_) for outline in outlines if len(outline) > 4 * SMALLEST_PROMINENCE_PX
    ]


def find_fingers(
    mask: NDArray[np.uint8], directions: Sequence[Direction], below_tip_px: float, reach_px: float
) -> CoarseFingers | NoGap:
    """Find the pair of fingers in a binary picture.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
        Non-zero where the fingers may be.
    directions : sequence of Direction
        Where the tips may point.
    below_tip_px : float
        Height of measuring below the tips.
    reach_px : float
        How far below the tips the outline is wanted.

    Returns
    -------
    CoarseFingers or NoGap
        The best pair in any of the directions, or why there is none.
    """
    outlines = find_outlines(mask)
    best: CoarseFingers | None = None
    alone: NoGap | None = None
    worst_reason = NoGap(Status.NO_FINGERS, "Nothing in the picture looks like a finger.")
    for direction in directions:
        orientation = Orientation(direction, *mask.shape)
        found = _best_pair(mask, outlines, orientation, below_tip_px, reach_px)
        if isinstance(found, NoGap):
            if found.status is Status.ONE_FINGER:
                alone = found
            if _SEVERITY.index(found.status) > _SEVERITY.index(worst_reason.status):
                worst_reason = found
        elif best is None or found.score > best.score:
            best = found
    if best is not None and not best.is_rooted and alone is not None:
        return alone
    return best or worst_reason


# Which reason says most, where several directions were tried.
_SEVERITY = (Status.NO_FINGERS, Status.ONE_FINGER, Status.TIP_OUT_OF_VIEW, Status.TOUCHING)


def _tops(mask: NDArray[np.uint8], outlines: list[Outline], orientation: Orientation) -> Iterator[Top]:
    upright = orientation.view(mask)
    for pixels in outlines:
        across, along = orientation.to_axes(pixels[:, 0], pixels[:, 1])
        lowest = int(np.argmax(along))
        outline = np.column_stack((np.roll(across, -lowest), np.roll(along, -lowest)))
        # Of two equally high places on one flat top the earlier is a little lower, so that one top remains.
        height = 1e-6 * np.arange(len(outline)) - outline[:, 1]
        # The outline is closed: its lowest point stands at both ends.
        peaks, properties = find_peaks(np.append(height, height[0]), prominence=SMALLEST_PROMINENCE_PX, plateau_size=1)
        for peak, prominence in zip(peaks, properties["prominences"], strict=True):
            a, r = outline[peak]
            below = min(int(r) + 2, orientation.along_size - 1)
            if not upright[below, a]:
                continue  # the top of a hole, not of a thing
            lowest_along = outline[0, 1]
            is_rooted = bool(lowest_along == orientation.along_size - 1 and prominence > 0.5 * (lowest_along - r))
            yield Top(outline, int(peak), float(prominence), is_rooted)


def _best_pair(
    mask: NDArray[np.uint8],
    outlines: list[Outline],
    orientation: Orientation,
    below_tip_px: float,
    reach_px: float,
) -> CoarseFingers | NoGap:
    tops = sorted(_tops(mask, outlines, orientation), key=lambda top: -top.prominence_px)[:MOST_TOPS]
    in_view = [top for top in tops if top.along_px > 0]
    best: CoarseFingers | None = None
    shallow = False
    for first, second in combinations(in_view, 2):
        left, right = sorted((first, second), key=lambda top: top.across_px)
        prominence = min(left.prominence_px, right.prominence_px)
        is_rooted = left.is_rooted or right.is_rooted
        if left.is_rooted != right.is_rooted and left.outline is not right.outline:
            continue  # one comes in from the border and one lies in view: a finger and a thing
        score = prominence * (ROOTED_BONUS if is_rooted else 1.0)
        if best is not None and score <= best.score:
            continue
        if prominence < below_tip_px + 1.0:
            deeper = max(left.prominence_px, right.prominence_px)
            is_notch = prominence > SMALLEST_NOTCH_SHARE * below_tip_px and deeper > LEAST_LENGTH_SHARE * below_tip_px
            shallow = shallow or is_notch
            continue
        if not _stand_side_by_side(left, right, below_tip_px):
            continue
        pair = (_follow(left, 1, below_tip_px, reach_px), _follow(right, -1, below_tip_px, reach_px))
        if pair[0] is None or pair[1] is None:
            continue
        if pair[0].outline[0, 0] <= pair[1].outline[0, 0]:  # the inner sides, in this order
            best = CoarseFingers(pair[0], pair[1], orientation, score, is_rooted)
    standing = sum(top.is_rooted and top.prominence_px > ROOTED_HEIGHTS * below_tip_px for top in in_view)
    if best is not None and (best.is_rooted or standing != 1):
        return best
    if shallow:
        return NoGap(Status.TOUCHING, "The fingers touch above the measuring height.")
    if sum(top.along_px == 0 for top in tops) >= 1 and len(tops) >= 2:
        return NoGap(Status.TIP_OUT_OF_VIEW, "A finger's tip lies beyond the picture's border.")
    if standing == 1 or (len(in_view) == 1 and in_view[0].prominence_px > below_tip_px):
        return NoGap(Status.ONE_FINGER, "Only one finger is in view.")
    return NoGap(Status.NO_FINGERS, "Nothing in the picture looks like two fingers.")


def _stand_side_by_side(left: Top, right: Top, below_tip_px: float) -> bool:
    """Whether each is there at the other's measuring height: things one behind the other are no fingers."""
    deepest = max(left.along_px, right.along_px) + below_tip_px
    return deepest <= min(left.along_px + left.prominence_px, right.along_px + right.prominence_px)


def _follow(top: Top, inner_sign: int, below_tip_px: float, reach_px: float) -> CoarseFinger | None:
    """The outline from the inner side over the top to the outer side, as far down as `reach_px` or as it goes."""
    along = top.outline[:, 1]
    limit = top.along_px + reach_px
    forward = _down_from(along[top.index :], limit)
    backward = _down_from(along[top.index :: -1], limit)
    start, stop = top.index - backward, top.index + forward
    piece = top.outline[start : stop + 1]
    ends_across = piece[0, 0], piece[-1, 0]
    if inner_sign * (ends_across[0] - ends_across[1]) < 0:
        piece = piece[::-1]
    if piece[0, 1] < top.along_px + below_tip_px:
        return None
    return CoarseFinger(np.ascontiguousarray(piece), inner_sign, top.along_px)


def _down_from(along: NDArray[np.int_], limit: float) -> int:
    """Steps until the outline has gone down to `limit`, or turns back up: at a notch, or at its own end."""
    lowest = np.maximum.accumulate(along)
    turned = lowest - along > SMALLEST_NOTCH_PX
    past = int(np.argmax(turned)) if turned.any() else len(along)
    reached = along[:past] >= limit
    return int(np.argmax(reached)) if reached.any() else int(np.argmax(along[:past]))

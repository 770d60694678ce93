"""Step 4, the boundary of the fingers: which two of everything in view they are, and where they point.

A finger is a place where the outline, followed from the tips' side of the picture, begins: a local top that goes on
downwards for some way before it ends or meets another (topographic prominence). Two fingers that touch are one blob
with two tops and a notch between them, and are found in the same way. What begins at the picture's own border has its
tip out of view.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.vision.orientation import Orientation

Outline = NDArray[np.int32]

# A top that is lower than this is noise or dust on an outline, whatever the scale (pixels).
SMALLEST_PROMINENCE_PX = 5.0
# An outline that comes back up by more than this has passed the bottom of a notch.
TURNED_PX = 3
# Two tops with a notch between them are touching fingers where the notch has so much of the measuring height, and the
# fingers so many times of it.
SMALLEST_NOTCH_SHARE, LEAST_LENGTH_SHARE = 0.3, 4.0
# Tops beyond this number are texture; the fingers are among the most prominent.
MOST_TOPS = 8
# Fingers come in from the picture's border; things that lie in view are less likely to be fingers.
ROOTED_BONUS = 2.0
# Things that lie in view and are shorter than so many times the measuring height are letters or dirt.
LYING_HEIGHTS = 6.0
# A lone finger that comes in from the border for so many times the measuring height makes everything else a thing.
ROOTED_HEIGHTS = 2.0


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


@dataclass(frozen=True, slots=True, eq=False)
class CoarseFinger:
    """A finger's outline to a pixel, in order from its inner side over the tip to its outer side.

    Parameters
    ----------
    outline : ndarray of int32, shape (n, 2)
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
        np.asarray(outline[:, 0, :], dtype=np.int32)
        for outline in outlines
        if len(outline) > 4 * SMALLEST_PROMINENCE_PX
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


def _tops(mask: NDArray[np.uint8], outlines: list[Outline], orientation: Orientation) -> list[Top]:
    upright = orientation.view(mask)
    found = []
    for pixels in outlines:
        outline = in_axes(pixels, orientation)
        bottom = outline[0, 1]
        for peak, prominence in zip(*_peaks(outline), strict=True):
            a, r = outline[peak]
            if not upright[min(int(r) + 2, orientation.along_size - 1), a]:
                continue  # the top of a hole, not of a thing
            is_rooted = bool(bottom == orientation.along_size - 1 and prominence > 0.5 * (bottom - r))
            found.append(Top(outline, int(peak), float(prominence), is_rooted))
    return found


def in_axes(pixels: Outline, orientation: Orientation) -> Outline:
    """A closed outline (x, y) in the fingers' axes, from its lowest point on: it rises and falls back to it."""
    return _from_lowest(pixels, orientation.direction.is_vertical, orientation.is_flipped, orientation.along_size)


@compiled
def _from_lowest(pixels: Outline, is_vertical: bool, is_flipped: bool, along_size: int) -> Outline:
    n, axis = pixels.shape[0], 1 if is_vertical else 0
    lowest = 0
    for i in range(1, n):
        down = pixels[i, axis] - pixels[lowest, axis]
        if (down < 0) if is_flipped else (down > 0):
            lowest = i
    outline = np.empty((n, 2), dtype=np.int32)
    for place in range(n):
        i = (lowest + place) % n
        outline[place, 0] = pixels[i, 1 - axis]
        outline[place, 1] = along_size - 1 - pixels[i, axis] if is_flipped else pixels[i, axis]
    return outline


@compiled
def _peaks(outline: Outline) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places and prominences of the tops of an outline that starts, and so ends, at its lowest point.

    A top counts once the outline has gone down from it by `SMALLEST_PROMINENCE_PX`, a valley once it has come up by as
    much. Of several equally high places of one top the last counts.
    """
    n = outline.shape[0]
    top, valley, tops = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), 0
    # The outermost place since the last valley, or the lowest since the last top.
    extreme, lowest, is_rising = 0, outline[0, 1], True
    for place in range(1, n + 1):
        i = place % n
        down = outline[i, 1] - outline[extreme, 1]
        if is_rising:
            if down <= 0:
                extreme = i
            elif down >= SMALLEST_PROMINENCE_PX:
                top[tops], valley[tops] = extreme, lowest
                tops, extreme, is_rising = tops + 1, i, False
        elif down > 0:
            extreme = i
        elif -down >= SMALLEST_PROMINENCE_PX:
            lowest, extreme, is_rising = outline[extreme, 1], i, True
    prominence = np.empty(tops, dtype=np.int64)
    for k in range(tops):
        height = outline[top[k], 1]
        before, after = height, height
        for j in range(k, -1, -1):
            before = max(before, valley[j])
            if j > 0 and outline[top[j - 1], 1] < height:
                break
        for j in range(k + 1, tops + 1):
            after = max(after, valley[j] if j < tops else outline[0, 1])
            if j < tops and outline[top[j], 1] <= height:
                break
        prominence[k] = min(before, after) - height
    return top[:tops], prominence


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
        if not is_rooted and prominence < LYING_HEIGHTS * below_tip_px:
            continue
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
    start, stop = (_end(top.outline, top.index, step, top.along_px + reach_px) for step in (-1, 1))
    piece = top.outline[start : stop + 1]
    if inner_sign * (piece[0, 0] - piece[-1, 0]) < 0:
        piece = piece[::-1]
    if piece[0, 1] < top.along_px + below_tip_px:
        return None
    return CoarseFinger(np.ascontiguousarray(piece), inner_sign, top.along_px)


@compiled
def _end(outline: Outline, top: int, step: int, limit: float) -> int:
    """Where the outline, followed from its top, has gone down to `limit`, or was lowest before it turned back up."""
    end, i = top, top
    while 0 <= i < outline.shape[0] and outline[end, 1] < limit and outline[end, 1] - outline[i, 1] <= TURNED_PX:
        if outline[i, 1] > outline[end, 1]:
            end = i
        i += step
    return end

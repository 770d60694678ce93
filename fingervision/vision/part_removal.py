"""A part between the fingers is taken out of the binary picture, and what it hides of the fingers is remembered.

Where the room between the fingers is bounded by two straight lines, whatever else lies between these lines is a part:
held by both fingers, stuck to one of them, or free. Without it the two fingers are found as ever, and the rows in which
it touches an inner edge are left out of the measurement.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.vision.channels import Channel, find_channel
from fingervision.vision.fingers import CoarseFinger, CoarseFingers, find_fingers
from fingervision.vision.orientation import Orientation
from fingervision.vision.way_between import inner_crossing

Ints = NDArray[np.int64]
Mask = NDArray[np.uint8]

# A part within so many pixels of an inner edge spoils its profiles, and in so many rows beyond its own.
NEAR_PX, BEYOND_PX = 7, 4
# The finger that was found has the channel's side within so many pixels, where it is not hidden.
ON_SIDE_PX = 2.5
# A part fills so much of the way between the fingers in the rows in which it is held.
FILLED_SHARE = 0.6
# Less than this many pixels in a row is a speck.
SPECK_PX = 2


def without_part(
    mask: Mask, directions: tuple[Direction, ...], below_tip_px: float, reach_px: float
) -> CoarseFingers | None:
    """The two fingers of a gripper with something between them, or None where there is no such thing.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
        Non-zero where the fingers may be.
    directions : tuple of Direction
        Where the tips may point.
    below_tip_px : float
        Height of measuring below the tips.
    reach_px : float
        How far below the tips the outline is wanted.
    """
    best: CoarseFingers | None = None
    for direction in directions:
        orientation = Orientation(direction, *mask.shape)
        upright = np.ascontiguousarray(orientation.view(mask))
        channel = find_channel(upright, below_tip_px)
        if channel is None:
            continue
        found = _found_without(mask, upright, channel, orientation, below_tip_px, reach_px)
        if found is not None and (best is None or found.score > best.score):
            best = found
    return best


def _found_without(
    mask: Mask, upright: Mask, channel: Channel, orientation: Orientation, below_tip_px: float, reach_px: float
) -> CoarseFingers | None:
    sides = (channel.left_c, channel.left_m, channel.right_c, channel.right_m)
    left_rows, right_rows, held_rows = _part_rows(upright, *sides, channel.last_row)
    if left_rows.size == 0 and right_rows.size == 0:
        return None
    cleared = mask.copy()
    _clear(orientation.view(cleared), *sides, channel.last_row)
    fingers = find_fingers(cleared, (orientation.direction,), below_tip_px, reach_px)
    if isinstance(fingers, NoGap):
        return None
    hidden = (_widened(left_rows), _widened(right_rows))
    pair = [replace(finger, hidden=rows) for finger, rows in zip((fingers.left, fingers.right), hidden, strict=True)]
    for finger, side in zip(pair, (channel.left, channel.right), strict=True):
        if not _is_on_side(finger, side(finger.top_along_px + reach_px), reach_px):
            return None
    tips = max(finger.top_along_px for finger in pair)
    held_rows = held_rows[held_rows > tips]
    held_at = float(np.median(held_rows)) if held_rows.size else None
    return replace(fingers, left=pair[0], right=pair[1], held_along_px=held_at)


def _is_on_side(finger: CoarseFinger, across: float, reach_px: float) -> bool:
    """Whether the finger that was found is the one that bounds the channel."""
    found, along = inner_crossing(finger.outline, finger.top_along_px + reach_px)
    return abs(found - across) <= ON_SIDE_PX + abs(along - finger.top_along_px - reach_px)


def _widened(rows: Ints) -> Ints:
    """Rows and their neighbours."""
    return np.unique((rows[:, None] + np.arange(-BEYOND_PX, BEYOND_PX + 1)).ravel())


@compiled
def _part_rows(
    upright: Mask, left_c: float, left_m: float, right_c: float, right_m: float, last_row: int
) -> tuple[Ints, Ints, Ints]:
    """Rows in which something lies at the left side, at the right one, and in which it fills the room between."""
    at_left, at_right, held = np.zeros(last_row + 1), np.zeros(last_row + 1), np.zeros(last_row + 1)
    columns = upright.shape[1]
    for row in range(last_row + 1):
        a, b = int(np.rint(left_c + left_m * row)), int(np.rint(right_c + right_m * row))
        if a < 0 or b >= columns or b - a < 2 * SPECK_PX + 2:
            continue
        # Two pixels beside the line may be the finger's own edge.
        first, past = a + 2, b - 1
        filled, left, right = 0, 0, 0
        for x in range(first, past):
            if upright[row, x]:
                filled += 1
                left += x < first + NEAR_PX
                right += x >= past - NEAR_PX
        at_left[row], at_right[row] = left >= SPECK_PX, right >= SPECK_PX
        held[row] = left >= SPECK_PX and right >= SPECK_PX and filled >= FILLED_SHARE * (past - first)
    return np.flatnonzero(at_left), np.flatnonzero(at_right), np.flatnonzero(held)


@compiled
def _clear(
    upright: Mask, left_c: float, left_m: float, right_c: float, right_m: float, last_row: int
) -> None:
    """Clear all between the two sides, from the picture's end down to the channel's."""
    columns = upright.shape[1]
    for row in range(last_row + 1):
        a, b = int(np.rint(left_c + left_m * row)), int(np.rint(right_c + right_m * row))
        for x in range(max(a + 1, 0), min(b, columns)):
            upright[row, x] = 0

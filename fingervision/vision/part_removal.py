"""Remove a held part from the binary picture, and record in which rows it hides the fingers' edges.

Any object in the space between the fingers (bounded by two straight lines) is a part: held by both fingers, stuck to
one of them, or free. After the removal of the part, the two fingers are found as usual; the rows in which the part
touches an inner edge are left out of the measurement.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.loops import loop
from fingervision.vision.channels import Channel, find_channel
from fingervision.vision.fingers import CoarseFinger, CoarseFingers, find_fingers, is_hidden
from fingervision.vision.orientation import Orientation
from fingervision.vision.way_between import inner_crossing

Ints = NDArray[np.int64]
Mask = NDArray[np.uint8]

# Distance from an inner edge (pixels) within which a part affects the edge's profiles, and number of further rows above
# and below the part that are affected.
NEAR_PX, BEYOND_PX = 8, 4
# Largest ratio of the covered to the visible length of an inner edge.
MOST_TIMES_COVERED = 4.0
# Number of rows of the flanks below a part that are used.
SEEN_BELOW_PX = 40
# Largest distance (pixels) of a finger's visible inner side from the side of the channel.
ON_SIDE_PX = 2.5
# Least number of pixels of a part in a row, below which it is a speck, and in all, below which it is dust.
SPECK_PX, SMALLEST_PART_PX = 2, 12
# Largest length (pixels) of a run at a side that is a remainder of the removed part instead of a finger.
SLIVER_PX = 8
# Least step (pixels) of an inner side within this number of rows that suggests a part in front of a straight edge.
STEP_PX, STEP_ROWS = 3.0, 3
# Least width of a part across the space between the fingers, in pixels and as a share of this space; touching fingers
# leave only a point.
FLOOR_PX, FLOOR_SHARE = 6, 0.3

_has_step = loop("part_removal_has_step")
_part_rows = loop("part_removal_part_rows")
_clear = loop("part_removal_clear")


def without_part(
    mask: Mask, directions: tuple[Direction, ...], below_tip_px: float, reach_px: float
) -> CoarseFingers | None:
    """Find the two fingers of a gripper with a part between them; None if there is no part.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
        Non-zero where the fingers may be.
    directions : tuple of Direction
        Directions in which the tips may point.
    below_tip_px : float
        Distance of the measuring point below the tip.
    reach_px : float
        Distance below the tips down to which the outline is needed.
    """
    best: CoarseFingers | None = None
    for direction in directions:
        orientation = Orientation(direction, *mask.shape)
        upright = orientation.upright(mask)
        channel = find_channel(upright, below_tip_px)
        if channel is None:
            continue
        found = _found_without(mask, upright, channel, orientation, below_tip_px, reach_px)
        if found is not None and (best is None or found.score > best.score):
            best = found
    return best


def looks_parted(fingers: CoarseFingers, below_tip_px: float, reach_px: float) -> bool:
    """Whether the inner sides suggest a part: an edge across the space between the fingers, or a step in one side.

    Parameters
    ----------
    fingers : CoarseFingers
        The fingers as found.
    below_tip_px : float
        Distance of the measuring point below the tip.
    reach_px : float
        Distance below the tips down to which the outline was followed.
    """
    left, right = fingers.left.outline, fingers.right.outline
    lowest = min(left[0, 1] - fingers.left.top_along_px, right[0, 1] - fingers.right.top_along_px)
    if fingers.is_joined and lowest < reach_px - 1.0:
        floor = right[0, 0] - left[0, 0]
        room = right[:, 0].min() - left[:, 0].max()
        if floor > max(FLOOR_PX, FLOOR_SHARE * room):
            return True
    return any(
        _has_step(finger.outline, finger.inner_sign, finger.top_along_px + 0.5 * below_tip_px)
        for finger in (fingers.left, fingers.right)
    )


def is_likelier(parted: CoarseFingers, below_tip_px: float) -> bool:
    """Whether the object found is a part, rather than a feature of both fingers' shape such as a nose at each tip."""
    hides = [is_hidden(finger, finger.top_along_px + below_tip_px) for finger in (parted.left, parted.right)]
    return parted.held_along_px is not None or not all(hides)


def _found_without(
    mask: Mask, upright: Mask, channel: Channel, orientation: Orientation, below_tip_px: float, reach_px: float
) -> CoarseFingers | None:
    sides = (channel.left_c, channel.left_m, channel.right_c, channel.right_m)
    flags = np.empty((3, channel.last_row + 1), dtype=np.bool_)
    if _part_rows(upright, *sides, channel.last_row, *flags) < SMALLEST_PART_PX:
        return None
    left_rows, right_rows, held_rows = map(np.flatnonzero, flags)
    cleared = mask.copy()
    _clear(np.asarray(orientation.view(cleared), dtype=np.uint8), *sides, channel.last_row)
    fingers = find_fingers(cleared, (orientation.direction,), below_tip_px, reach_px)
    if isinstance(fingers, NoGap):
        return None
    tips = max(fingers.left.top_along_px, fingers.right.top_along_px)
    held_rows = held_rows[held_rows > tips]
    if held_rows.size and held_rows[-1] + SEEN_BELOW_PX > tips + reach_px:
        # The flanks are followed to a height at which they are visible again.
        deeper_px = float(held_rows[-1] + SEEN_BELOW_PX - tips)
        deeper = find_fingers(cleared, (orientation.direction,), below_tip_px, deeper_px)
        if isinstance(deeper, CoarseFingers):
            fingers, reach_px = deeper, deeper_px
    covered = channel.first_row - tips
    if covered > MOST_TIMES_COVERED * channel.rows:
        return None
    hidden = (_widened(left_rows), _widened(right_rows))
    pair = [replace(finger, hidden=rows) for finger, rows in zip((fingers.left, fingers.right), hidden, strict=True)]
    for finger, side in zip(pair, (channel.left, channel.right), strict=True):
        if not _is_on_side(finger, side(finger.top_along_px + reach_px), reach_px):
            return None
    held_at = float(np.median(held_rows)) if held_rows.size else None
    return replace(fingers, left=pair[0], right=pair[1], held_along_px=held_at)


def _is_on_side(finger: CoarseFinger, across: float, reach_px: float) -> bool:
    """Whether a finger is the one that bounds the channel on a given side."""
    found, along = inner_crossing(finger.outline, finger.top_along_px + reach_px)
    return abs(found - across) <= ON_SIDE_PX + abs(along - finger.top_along_px - reach_px)


def _widened(rows: Ints) -> Ints:
    """Add the rows above and below to a set of rows."""
    return np.unique((rows[:, None] + np.arange(-BEYOND_PX, BEYOND_PX + 1)).ravel())

"""Remove a held part from the binary picture, and record in which rows it hides the fingers' edges.

Any object in the space between the fingers (bounded by two straight lines) is a part: held by both fingers, stuck to
one of them, or free. After the removal of the part, the two fingers are found as usual; the rows in which the part
touches an inner edge are left out of the measurement.

Find the background channel between two straight sides: the space between the fingers that no part fills.

With the tips up, each row of a binary picture has runs of background pixels between runs of finger or part pixels.
Background runs in successive rows form a channel if their ends differ by hardly a pixel. A gripper that holds a part
shows a channel above the part, a channel below it, or both, between the same two straight lines.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.loops import loop
from fingervision.vision.fingers import CoarseFinger, CoarseFingers, find_fingers, is_hidden
from fingervision.vision.likeness import Build, are_alike
from fingervision.vision.orientation import Orientation
from fingervision.vision.way_between import inner_crossing

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.uint8]

# Least width (pixels) of a run of background, as narrower runs are scratches, and of the objects on both of its sides.
LEAST_GROUND_PX, LEAST_BESIDE_PX = 3, 5
# Largest displacement of a channel's sides from row to row: a slope of 25 degrees, and one pixel of noise.
MOST_STEP_PX = 2
# Least number of rows of a channel, as a multiple of the measuring height (in pixels), and absolutely.
LEAST_HEIGHTS, LEAST_ROWS = 1.5, 14
# Least share of a channel's rows whose sides lie within this distance (pixels) of a straight line; corners and fillets
# do not.
ON_LINE_SHARE, ON_LINE_PX = 0.75, 1.2
# Largest distance (pixels) of a second channel of the same fingers from the line through the first, and largest slope
# of the sides.
SAME_LINE_PX, STEEPEST = 2.5, 0.55
# Largest number of channels that are examined, the longest first.
MOST_CHANNELS = 6
# Largest number of background runs that are examined; a picture with more runs shows texture.
MOST_RUNS = 4096

_lines = loop("part_removal_lines")
_beside_lines = loop("part_removal_beside")
_follow_chain = loop("part_removal_chain")
_find_runs = loop("part_removal_runs")


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """Background between two fingers, bounded on either side by a straight line: column = c + m row.

    The left line runs through the last pixels of the left finger, the right line through the first pixels of the right
    finger.

    Parameters
    ----------
    left_c, left_m, right_c, right_m : float
        Coefficients c and m of the left and of the right line.
    first_row, last_row : int
        First and last row of the channel, including rows where a part interrupts it.
    rows : int
        Number of rows in which the channel is open.
    """

    left_c: float
    left_m: float
    right_c: float
    right_m: float
    first_row: int
    last_row: int
    rows: int

    def left(self, row: float) -> float:
        """Column of the left finger's last pixel in a row."""
        return self.left_c + self.left_m * row

    def right(self, row: float) -> float:
        """Column of the right finger's first pixel in a row."""
        return self.right_c + self.right_m * row


def find_channel(upright: Mask, below_tip_px: float) -> Channel | None:
    """Find the longest channel between two objects of similar width; return None if there is none.

    Parameters
    ----------
    upright : ndarray of uint8, shape (rows, columns)
        Non-zero where the fingers may be; turned so that the tips point up.
    below_tip_px : float
        Distance of the measuring point below the tip.
    """
    shortest = int(max(LEAST_HEIGHTS * below_tip_px, LEAST_ROWS))
    chains = _chains(upright, shortest)
    lines = [found for chain in chains if (found := _straight(chain)) is not None]
    lines.sort(key=lambda channel: -channel.rows)
    for channel in lines[:MOST_CHANNELS]:
        if not are_alike(*_beside(upright, channel)):
            continue
        same = [other for other in lines if other is channel or _is_same(channel, other)]
        if len(same) == 1:
            return channel
        chosen = np.concatenate([chain for chain in chains if _lies_on(chain, channel)])
        joined = _straight(chosen[np.argsort(chosen[:, 0])])
        if joined is not None:
            return joined
    return None


def _lies_on(chain: Ints, channel: Channel) -> bool:
    row, left, right = chain.mean(axis=0).tolist()
    return bool(abs(left - channel.left(row)) <= SAME_LINE_PX and abs(right - channel.right(row)) <= SAME_LINE_PX)


def _is_same(channel: Channel, other: Channel) -> bool:
    row = 0.5 * (other.first_row + other.last_row)
    return (
        abs(channel.left(row) - other.left(row)) <= SAME_LINE_PX
        and abs(channel.right(row) - other.right(row)) <= SAME_LINE_PX
    )


def _straight(chain: Ints) -> Channel | None:
    """Fit straight lines to the two sides of a chain of runs; return None if the sides are not straight."""
    left_c, left_m, left_share, right_c, right_m, right_share, first_row, last_row = _lines(chain)
    if min(left_share, right_share) < ON_LINE_SHARE or max(abs(left_m), abs(right_m)) > STEEPEST:
        return None
    return Channel(left_c, left_m, right_c, right_m, first_row, last_row, len(chain))


def _beside(upright: Mask, channel: Channel) -> tuple[Build, Build]:
    """Widths of the objects to the left and to the right of a channel (pixels)."""
    sides = (channel.left_c, channel.left_m, channel.right_c, channel.right_m)
    widths = _beside_lines(upright, *sides, channel.first_row, channel.last_row)
    last = upright.shape[1] - 1
    middle_row = 0.5 * (channel.first_row + channel.last_row)
    cut = (
        channel.left(middle_row) - widths[0] < 0.5,
        channel.right(middle_row) + widths[1] > last - 0.5,
    )
    return Build(widths[0], channel.left_m, cut[0]), Build(widths[1], channel.right_m, cut[1])


def _chains(upright: Mask, shortest: int) -> list[Ints]:
    """Chains of runs with at least `shortest` rows: (row, last pixel on the left, first pixel on the right)."""
    runs, previous, length, has_next = _runs(np.ascontiguousarray(upright))
    ends = np.flatnonzero(~has_next & (length >= shortest))
    ends = ends[np.argsort(-length[ends], kind="stable")][: 4 * MOST_CHANNELS]
    return [_chain(runs, previous, int(end), int(length[end])) for end in ends]


def _chain(runs: Ints, previous: Ints, end: int, length: int) -> Ints:
    chain = np.empty((length, 3), dtype=np.int64)
    _follow_chain(runs, previous, end, chain)
    return chain


def _runs(upright: Mask) -> tuple[Ints, Ints, Ints, NDArray[np.bool_]]:
    """All runs of background between objects, linked into chains from row to row."""
    runs, has_next = np.empty((MOST_RUNS, 3), dtype=np.int64), np.empty(MOST_RUNS, dtype=np.bool_)
    previous, length = np.empty((2, MOST_RUNS), dtype=np.int64)
    count = _find_runs(upright, runs, previous, length, has_next)
    return runs[:count], previous[:count], length[:count], has_next[:count]


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

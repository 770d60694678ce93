"""Step 4, finding the fingers: which two objects in view are the fingers, and in which direction they point.

A tip is a local maximum of an outline in the direction in which the tips point, with a sufficient topographic
prominence. Two touching fingers are one object with two local maxima and a notch between them, and are found by the
same criteria. If an outline's local maximum is at the picture's border, the tip is out of view. Only background may lie
between the two fingers, and no third object beside them may look like a finger.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.vision.coarse_fingers import CoarseFinger, CoarseFingers, is_hidden
from fingervision.vision.flanks import follow_down, has_straight_flanks
from fingervision.vision.likeness import MOST_TURNED, Build, are_alike, build, common_turn, end_alike, lie_level
from fingervision.vision.orientation import Orientation
from fingervision.vision.outlines import Outline, Outlines, find_outlines, longest_first
from fingervision.vision.tops import Top, find_tops
from fingervision.vision.way_between import Place, inner_crossing, is_free

__all__ = ["MORE_THAN_TWO", "UNLIKE", "CoarseFinger", "CoarseFingers", "find_fingers", "is_hidden"]

# Two local maxima are the tips of touching fingers if the notch between them is this share of the measuring height
# deep, and the fingers are this multiple of it long.
SMALLEST_NOTCH_SHARE, LEAST_LENGTH_SHARE = 0.3, 4.0
# Factor on the score of objects that extend from the picture's border, as fingers usually do.
ROOTED_BONUS = 2.0
# Least length of an object that lies completely in view, as a multiple of the measuring height; shorter objects are
# letters or dirt.
LYING_HEIGHTS = 6.0
# Least ratio of length to width of an object that lies completely in view, which excludes coins.
LYING_SLENDER = 1.5
# Largest distance of two objects that lie completely in view, as a multiple of the length of the shorter object; the
# gap of real fingers is smaller.
LYING_APART = 2.0
# Share of the fingers' outline length above which a third outline excludes that two objects in view are fingers.
COMPANY_SHARE = 0.4
# Length, as a multiple of the measuring height, above which an object that extends from the border is a finger; objects
# that lie completely in view are then no fingers.
ROOTED_HEIGHTS = 2.0
# Share of the fingers' height, and largest inclination, at which a third object beside the two may be a finger as well.
THIRD_SHARE, THIRD_STEEPEST = 0.5, 1.0

MORE_THAN_TWO = NoGap(
    Status.NO_FINGERS,
    "More than two objects in the picture look like fingers: give the region of the two fingers (--roi).",
)
SHALLOW = NoGap(Status.TOUCHING, "The fingers touch above the measuring height.")
UNLIKE = NoGap(
    Status.ONE_FINGER,
    "The two objects in the picture differ too much in width to be fingers of one gripper: give the region of the two "
    "fingers (--roi).",
)


def find_fingers(
    mask: NDArray[np.uint8], directions: Sequence[Direction], below_tip_px: float, reach_px: float
) -> CoarseFingers | NoGap:
    """Find the pair of fingers in a binary picture.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
        Non-zero where the fingers may be.
    directions : sequence of Direction
        Directions in which the tips may point.
    below_tip_px : float
        Distance of the measuring point below the tip.
    reach_px : float
        Distance below the tips down to which the outline is needed.

    Returns
    -------
    CoarseFingers or NoGap
        The best pair in any of the directions, or the reason why there is none.
    """
    outlines = find_outlines(mask)
    best: CoarseFingers | None = None
    alone: NoGap | None = None
    worst_reason = NoGap(Status.NO_FINGERS, "No object in the picture looks like a finger.")
    is_unlike = False
    for direction, longest_px in longest_first(outlines, directions):
        if best is not None and best.is_rooted and ROOTED_BONUS * longest_px <= best.score:
            break  # no object is long enough for a better pair
        orientation = Orientation(direction, *mask.shape)
        found = _best_pair(mask, outlines, orientation, below_tip_px, reach_px)
        if isinstance(found, NoGap):
            if found.status is Status.ONE_FINGER:
                alone = found
            if found is MORE_THAN_TWO:
                return found
            is_unlike = is_unlike or found is UNLIKE
            if _SEVERITY.index(found.status) > _SEVERITY.index(worst_reason.status):
                worst_reason = found
        elif best is None or found.score > best.score:
            best = found
    if best is not None and not best.is_rooted and not best.is_joined and alone is not None:
        return alone
    return best or (UNLIKE if is_unlike else worst_reason)


# Order of the reasons by their relevance, if several directions were tried.
_SEVERITY = (Status.NO_FINGERS, Status.ONE_FINGER, Status.TIP_OUT_OF_VIEW, Status.TOUCHING)


def _best_pair(
    mask: NDArray[np.uint8],
    outlines: Outlines,
    orientation: Orientation,
    below_tip_px: float,
    reach_px: float,
) -> CoarseFingers | NoGap:
    tops = find_tops(mask, outlines, orientation)
    in_view = [top for top in tops if top.along_px > 0]
    best: CoarseFingers | None = None
    two: tuple[Top, Top] | None = None
    reasons: list[NoGap] = []
    across = [top.across_px for top in in_view]
    for i, j in combinations(range(len(in_view)), 2):
        left, right = (in_view[i], in_view[j]) if across[i] <= across[j] else (in_view[j], in_view[i])
        is_rooted = left.is_rooted or right.is_rooted
        score = min(left.prominence_px, right.prominence_px) * (ROOTED_BONUS if is_rooted else 1.0)
        if best is not None and score <= best.score:
            continue
        found = _as_pair(mask, outlines, orientation, (left, right), score, below_tip_px, reach_px)
        if isinstance(found, NoGap):
            reasons.append(found)
        elif found is not None:
            best, two = found, (left, right)
    if best is not None and two is not None:
        for top in in_view:
            if top not in two and _is_third(top, best, below_tip_px):
                return MORE_THAN_TWO
        if _has_second_pair(in_view, two, best, below_tip_px):
            return MORE_THAN_TWO
        if best.is_rooted or best.is_joined or len(_standing(in_view, below_tip_px)) != 1:
            return best
    if SHALLOW in reasons:
        return SHALLOW
    return UNLIKE if UNLIKE in reasons else _why_none(tops, below_tip_px)


def _as_pair(
    mask: NDArray[np.uint8],
    outlines: Outlines,
    orientation: Orientation,
    pair_of_tops: tuple[Top, Top],
    score: float,
    below_tip_px: float,
    reach_px: float,
) -> CoarseFingers | NoGap | None:
    """Two objects as a pair of fingers; None if they are none, or why two fingers cannot be measured."""
    left, right = pair_of_tops
    prominence = min(left.prominence_px, right.prominence_px)
    is_rooted = left.is_rooted or right.is_rooted
    if left.is_rooted != right.is_rooted and left.outline is not right.outline:
        return None  # one object extends from the border, the other lies in view: a finger and another object
    if not is_rooted and (prominence < LYING_HEIGHTS * below_tip_px or _has_company(left.outline, outlines)):
        return None
    if prominence < below_tip_px + 1.0:
        deeper = max(left.prominence_px, right.prominence_px)
        is_notch = prominence > SMALLEST_NOTCH_SHARE * below_tip_px and deeper > LEAST_LENGTH_SHARE * below_tip_px
        return SHALLOW if is_notch and all(has_straight_flanks(top, below_tip_px) for top in pair_of_tops) else None
    if not _end_alike(left, right, below_tip_px) or not _stand_side_by_side(left, right, below_tip_px):
        return None
    pair = (_follow(left, 1, below_tip_px, reach_px), _follow(right, -1, below_tip_px, reach_px))
    if pair[0] is None or pair[1] is None or pair[0].outline[0, 0] > pair[1].outline[0, 0]:
        return None  # inner sides of the left and of the right finger
    builds = (build(left, 1, orientation.across_size), build(right, -1, orientation.across_size))
    if not are_alike(*builds):
        return UNLIKE if is_rooted and all(has_straight_flanks(top, below_tip_px) for top in pair_of_tops) else None
    if not _end_alike(left, right, below_tip_px, builds):
        return None
    is_lying = not is_rooted and left.outline is not right.outline
    if is_lying and not _lie_as_a_pair(pair_of_tops, builds, prominence, below_tip_px):
        return None
    if not _is_open(mask, pair[0], pair[1], orientation, below_tip_px, builds):
        return None
    return CoarseFingers(pair[0], pair[1], orientation, score, is_rooted, builds[0].is_cut and builds[1].is_cut)


def _lie_as_a_pair(tops: tuple[Top, Top], builds: tuple[Build, Build], prominence: float, below_tip_px: float) -> bool:
    """Whether two objects that lie in view without reaching the border are slender, near, and level with each other."""
    left, right = tops
    if any(top.prominence_px < LYING_SLENDER * one.width_px for top, one in zip(tops, builds, strict=True)):
        return False
    step_px, apart_px = right.along_px - left.along_px, right.across_px - left.across_px
    is_far = apart_px - 0.5 * sum(one.width_px for one in builds) > LYING_APART * prominence
    return not is_far and lie_level(step_px, apart_px, below_tip_px, builds)


def _has_company(own: Outline, outlines: Outlines) -> bool:
    """Whether other objects of similar size are in view, as the letters of a text are."""
    return outlines.third_length > COMPANY_SHARE * len(own)


def _is_third(top: Top, fingers: CoarseFingers, below_tip_px: float) -> bool:
    """Whether a third object resembles a finger as much as the two selected objects do."""
    two = (fingers.left, fingers.right)
    lower = min((finger.top for finger in two), key=lambda finger: finger.prominence_px)
    if (
        not (top.is_rooted == lower.is_rooted or top.outline is lower.outline)
        or top.prominence_px <= THIRD_SHARE * lower.prominence_px
        or not all(_stand_side_by_side(top, finger.top, below_tip_px) for finger in two)
        or not has_straight_flanks(top, below_tip_px, THIRD_STEEPEST)
    ):
        return False
    size = fingers.orientation.across_size
    own = build(top, 1 if top.across_px < fingers.left.top.across_px else -1, size)
    for finger in two:
        other = build(finger.top, finger.inner_sign, size)
        builds = (own, other) if top.across_px < finger.top.across_px else (other, own)
        if are_alike(*builds) and _end_alike(top, finger.top, below_tip_px, builds):
            return True
    return False


def _has_second_pair(tops: list[Top], two: tuple[Top, Top], fingers: CoarseFingers, below_tip_px: float) -> bool:
    """Whether a second pair of objects at the border, of another width, looks as much like two fingers."""
    lower = min(top.prominence_px for top in two)
    others = [
        top
        for top in tops
        if fingers.is_rooted
        and top.is_rooted
        and top not in two
        and top.prominence_px > THIRD_SHARE * lower
        and has_straight_flanks(top, below_tip_px)
    ]
    size = fingers.orientation.across_size
    for first, second in combinations(others, 2):
        left, right = sorted((first, second), key=lambda top: top.across_px)
        builds = (build(left, 1, size), build(right, -1, size))
        is_pair = are_alike(*builds) and _end_alike(left, right, below_tip_px, builds)
        if is_pair and _stand_side_by_side(left, right, below_tip_px):
            return True
    return False


def _standing(tops: list[Top], below_tip_px: float) -> list[Top]:
    """Objects that extend to the picture's border, as a finger does."""
    return [
        top
        for top in tops
        if top.is_rooted
        and top.prominence_px > ROOTED_HEIGHTS * below_tip_px
        and has_straight_flanks(top, below_tip_px)
    ]


def _why_none(tops: list[Top], below_tip_px: float) -> NoGap:
    """Reason why no two fingers were found."""
    standing = _standing(tops, below_tip_px)
    if len(standing) > 2:
        return MORE_THAN_TWO
    if len(standing) == 2 and any(top.along_px == 0 for top in standing):
        return NoGap(Status.TIP_OUT_OF_VIEW, "A finger's tip lies beyond the picture's border.")
    alone = [top for top in tops if top.along_px > 0]
    if len(standing) == 1 or (len(alone) == 1 and has_straight_flanks(alone[0], below_tip_px)):
        return NoGap(Status.ONE_FINGER, "Only one finger is in view.")
    return NoGap(Status.NO_FINGERS, "No two objects in the picture look like two fingers.")


def _end_alike(first: Top, second: Top, below_tip_px: float, builds: tuple[Build, Build] | None = None) -> bool:
    """Whether two tips are at about the same height along the fingers (also for a turned camera)."""
    left, right = (first, second) if first.across_px <= second.across_px else (second, first)
    step_px, apart_px = right.along_px - left.along_px, right.across_px - left.across_px
    return end_alike(step_px, apart_px, below_tip_px, builds)


def _stand_side_by_side(left: Top, right: Top, below_tip_px: float) -> bool:
    """Whether each finger extends to the other's measuring height; objects one above the other are not fingers."""
    deepest = max(left.along_px, right.along_px) + below_tip_px
    return deepest <= min(left.along_px + left.prominence_px, right.along_px + right.prominence_px)


def _follow(top: Top, inner_sign: int, below_tip_px: float, reach_px: float) -> CoarseFinger | None:
    """Outline from the inner side over the tip to the outer side, down to `reach_px` below the tip or to its end."""
    start, stop = (follow_down(top.outline, top.index, step, top.along_px + reach_px) for step in (-1, 1))
    piece = top.outline[start : stop + 1]
    if inner_sign * (piece[0, 0] - piece[-1, 0]) < 0:
        piece = piece[::-1]
    if min(piece[0, 1], piece[-1, 1]) < top.along_px + below_tip_px:
        return None  # the object that begins here is a speck on a finger
    return CoarseFinger(np.ascontiguousarray(piece), inner_sign, top)


def _is_open(
    mask: NDArray[np.uint8],
    left: CoarseFinger,
    right: CoarseFinger,
    orientation: Orientation,
    below_tip_px: float,
    builds: tuple[Build, Build],
) -> bool:
    """Whether the straight path between the two measuring points is almost free of other objects.

    If the camera is turned, a corner of one finger may lie on the straight path; then a horizontal path at the lower of
    the two measuring heights is tested.
    """
    heights = [finger.top_along_px + below_tip_px for finger in (left, right)]
    if is_free(mask, *_inner_places(left, right, orientation, heights)):
        return True
    if abs(common_turn((builds[0].lean, builds[1].lean))) <= MOST_TURNED:
        return False
    return is_free(mask, *_inner_places(left, right, orientation, [max(heights)] * 2))


def _inner_places(
    left: CoarseFinger, right: CoarseFinger, orientation: Orientation, heights: list[float]
) -> tuple[Place, Place]:
    """Picture coordinates at which the two inner sides have the given heights, to the nearest pixel."""
    first, second = (
        orientation.to_pixels(*inner_crossing(finger.outline, height))
        for finger, height in zip((left, right), heights, strict=True)
    )
    return first, second

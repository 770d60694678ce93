"""Candidate pairs of fingers in the dark or light class of a picture, split by one threshold or by the local mean.

Detection of an object, such as a cable, that crosses the fingers and hides their ends in the binary picture.

If an object crosses the fingers, their apparent tips are the edge of this object. Beyond a true tip there is background
or some other object; a piece of the same width that continues along the same two lines is the finger itself.

Recognise a space between two strokes of a letter, which looks like the gap between two fingers.

If the paper of a printed text is taken for the objects, and the letters for the background, the spaces inside and
between letters look like bars that extend from the picture's border. Between two apparent bars in a text lies a part of
a letter, and the picture contains other parts of the same size. Between two fingers lies the background, which is a
single region.
"""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.loops import loop
from fingervision.domain.status import Status
from fingervision.vision.binarise import Binary, binarise_local
from fingervision.vision.coarse_fingers import CoarseFinger, CoarseFingers
from fingervision.vision.fingers import MORE_THAN_TWO, UNLIKE, find_fingers
from fingervision.vision.grey import GreyImage
from fingervision.vision.part_removal import is_likelier, looks_parted, without_part
from fingervision.vision.settings import Settings
from fingervision.vision.way_between import inner_crossing

# Distance beyond the tip within which a continuation of the finger is searched (pixels, and as a multiple of the
# measuring height).
BEYOND_PX, BEYOND_HEIGHTS = 40, 8.0
# Least number of rows of a continuation, in each of which this share of the finger's width is covered, and the pixels
# at this distance from both sides are not.
FEWEST_ROWS, FILLED_SHARE, SIDE_PX = 5, 0.9, 5
# Range of heights below the tip in which lines are fitted to the finger's two sides (in units of the measuring height).
FROM_HEIGHTS, TO_HEIGHTS = 1.0, 4.0

CROSSED = NoGap(
    Status.NO_FINGERS,
    "An object lies across the fingers and hides their tips: remove the object, or give a region without it (--roi).",
)

_rows_beyond = loop("candidates_rows_beyond")


def is_crossed(mask: NDArray[np.uint8], fingers: CoarseFingers, below_tip_px: float) -> bool:
    """Whether either finger continues beyond its apparent tip.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
        Non-zero where the fingers may be.
    fingers : CoarseFingers
        The fingers as found in the mask.
    below_tip_px : float
        Distance of the measuring point below the tip.
    """
    upright = np.asarray(fingers.orientation.view(mask), dtype=np.uint8)
    return any(_goes_on(upright, finger, below_tip_px) for finger in (fingers.left, fingers.right))


def _goes_on(upright: NDArray[np.uint8], finger: CoarseFinger, below_tip_px: float) -> bool:
    top, reach = finger.top_along_px, int(max(BEYOND_PX, BEYOND_HEIGHTS * below_tip_px))
    heights = (FROM_HEIGHTS * below_tip_px, TO_HEIGHTS * below_tip_px)
    return bool(_rows_beyond(upright, finger.outline, top, *heights, reach) >= FEWEST_ROWS)


# Largest ratio of lengths of objects of the same size, and least number of such objects that indicates a text; a
# mechanism around its gap has only a few openings of this size.
SAME_SIZE, FEWEST_OTHERS = 2.5, 5

LETTERS = NoGap(
    Status.NO_FINGERS,
    "The object between the two supposed fingers is one of several objects of the same size, as in a text: give the "
    "region of the two fingers (--roi).",
)


_same_size = loop("candidates_same_size")


def has_company(mask: NDArray[np.uint8], fingers: CoarseFingers, below_tip_px: float) -> bool:
    """Whether the object between two fingers is one of several objects of similar size.

    Parameters
    ----------
    mask : ndarray of uint8, shape (height, width)
        Non-zero where the fingers may be.
    fingers : CoarseFingers
        The fingers as found in the mask.
    below_tip_px : float
        Distance of the measuring point below the tip.
    """
    height = max(finger.top_along_px for finger in (fingers.left, fingers.right)) + below_tip_px
    across = [inner_crossing(finger.outline, height)[0] for finger in (fingers.left, fingers.right)]
    x, y = (round(place) for place in fingers.orientation.to_pixels(0.5 * sum(across), height))
    if not (0 <= x < mask.shape[1] and 0 <= y < mask.shape[0]):
        return False
    return int(_same_size(np.ascontiguousarray(mask), x, y)) > FEWEST_OTHERS


# Least difference of the two classes, in units of the standard deviation within the classes.
SEPARATION_FLOOR = 3.0
# Separation above which the two classes are not caused by uneven light, so that a second split would find the same
# objects again.
CLEAR_SEPARATION = 8.0
# Distance on either side of an edge (pixels) within which even an edge with the largest blur (5 px) changes by half of
# its contrast, and the least change as a share of the contrast; gradual shading changes less.
EDGE_REACH_PX, EDGE_SHARE = 3, 0.2
# Light background on both sides of a single dark object looks like two light fingers at the picture's border.
MAY_BE_GROUND = NoGap(
    Status.NO_FINGERS,
    "Light areas on both sides of a dark object reach the picture's borders: state --fingers light if the light areas "
    "are the fingers.",
)
# Length of outline that is used below the measuring height (pixels, or in units of the measuring height).
REACH_BELOW_PX, REACH_BELOW_HEIGHTS = 45.0, 1.5


def candidates(
    denoised: GreyImage, binary: Binary, settings: Settings
) -> Iterator[tuple[Binary, CoarseFingers | NoGap, bool]]:
    """Candidate pairs of fingers, likeliest first.

    Each of the two splits (one threshold, then the local mean) gives a pair in its dark and in its light class; the
    class that differs from the picture's border comes first.
    """
    directions = tuple(Direction) if settings.direction is None else (settings.direction,)
    clear = False
    for is_local in (False, True):
        split = binarise_local(denoised) if is_local else binary
        if split.separation < SEPARATION_FLOOR:
            continue
        dark_first = _border_is_light(split)
        unsure: list[tuple[Binary, CoarseFingers | NoGap, bool]] = []
        for light_gap in (dark_first, not dark_first):
            if settings.fingers_are_dark not in (None, light_gap):
                continue
            fingers = found(split, light_gap, directions, settings, has_parts=not is_local)
            if (
                not light_gap
                and settings.fingers_are_dark is None
                and isinstance(fingers, CoarseFingers)
                and fingers.are_cut
            ):
                fingers = MAY_BE_GROUND
            # The class of the picture's border may be a sheet of printed paper.
            if light_gap is not dark_first and isinstance(fingers, CoarseFingers):
                mask = split.dark if light_gap else split.light
                fingers = LETTERS if has_company(mask, fingers, settings.below_tip_px) else fingers
            if isinstance(fingers, CoarseFingers) and not (fingers.is_rooted or fingers.is_joined):
                unsure.append((split, fingers, light_gap))  # an object of the other polarity may extend from the border
            else:
                yield split, fingers, light_gap
                clear = (
                    clear
                    or fingers is UNLIKE
                    or fingers is CROSSED
                    or (fingers is MORE_THAN_TWO and split.separation > CLEAR_SEPARATION)
                )
        yield from unsure
        if clear:
            break


def found(
    split: Binary, light_gap: bool, directions: tuple[Direction, ...], settings: Settings, *, has_parts: bool = True
) -> CoarseFingers | NoGap:
    """Fingers found in one class (dark or light) of a binary picture, also with a part held between them.

    In a picture split by its local mean, objects appear hollow; the hollow parts are not gaps between fingers.
    """
    below = settings.below_tip_px
    reach = below + max(REACH_BELOW_PX, REACH_BELOW_HEIGHTS * below)
    mask = split.dark if light_gap else split.light
    fingers = find_fingers(mask, directions, below, reach)
    if has_parts:
        if isinstance(fingers, NoGap):
            fingers = fingers if fingers is UNLIKE else without_part(mask, directions, below, reach) or fingers
        elif looks_parted(fingers, below, reach):
            parted = without_part(mask, (fingers.orientation.direction,), below, reach)
            if parted is not None and is_likelier(parted, below):
                fingers = parted
    return CROSSED if isinstance(fingers, CoarseFingers) and is_crossed(mask, fingers, below) else fingers


def local_change(denoised: GreyImage) -> GreyImage:
    """Range of the grey levels within `EDGE_REACH_PX` of each pixel."""
    square = np.ones((2 * EDGE_REACH_PX + 1, 2 * EDGE_REACH_PX + 1), dtype=np.uint8)
    return cv2.morphologyEx(denoised, cv2.MORPH_GRADIENT, square)  # type: ignore[return-value]


def has_edges(change: GreyImage, split: Binary, contrast: float) -> bool:
    """Whether the grey level changes steeply at the border of light and dark, as even the most blurred edge does.

    Parameters
    ----------
    change : ndarray, shape (height, width)
        Range of the grey levels around each pixel (`local_change`).
    split : Binary
        Light and dark pixels.
    contrast : float
        Difference of the mean grey levels of light and dark.
    """
    border = np.asarray(cv2.morphologyEx(split.dark, cv2.MORPH_GRADIENT, np.ones((3, 3), dtype=np.uint8))) > 0
    least = EDGE_SHARE * contrast
    # The median exceeds `least` if more than half of the pixels do; counting takes a third of the time of a median.
    steep, pixels = int(np.count_nonzero((change > int(least)) & border)), int(np.count_nonzero(border))
    if 2 * steep == pixels:
        return bool(pixels and np.median(change[border]) > least)
    return 2 * steep > pixels


def _border_is_light(binary: Binary) -> bool:
    """Whether most of the picture's border shows light background."""
    dark = binary.dark
    border = (dark[0], dark[-1], dark[:, 0], dark[:, -1])
    return sum(int(np.count_nonzero(side)) for side in border) < 0.5 * sum(side.size for side in border)

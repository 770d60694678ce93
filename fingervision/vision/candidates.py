"""Candidate pairs of fingers in the dark or light class of a picture, split by one threshold or by the local mean."""

from collections.abc import Iterator

import cv2
import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.vision.binarise import Binary, binarise_local
from fingervision.vision.crossing import CROSSED, is_crossed
from fingervision.vision.fingers import MORE_THAN_TWO, UNLIKE, CoarseFingers, find_fingers
from fingervision.vision.gap_company import LETTERS, has_company
from fingervision.vision.grey import GreyImage
from fingervision.vision.part_removal import is_likelier, looks_parted, without_part
from fingervision.vision.settings import Settings

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

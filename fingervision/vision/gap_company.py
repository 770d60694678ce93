"""Recognise a space between two strokes of a letter, which looks like the gap between two fingers.

If the paper of a printed text is taken for the objects, and the letters for the background, the spaces inside and
between letters look like bars that extend from the picture's border. Between two apparent bars in a text lies a part of
a letter, and the picture contains other parts of the same size. Between two fingers lies the background, which is a
single region.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gap import NoGap
from fingervision.domain.loops import loop
from fingervision.domain.status import Status
from fingervision.vision.coarse_fingers import CoarseFingers
from fingervision.vision.way_between import inner_crossing

# Largest ratio of lengths of objects of the same size, and least number of such objects that indicates a text; a
# mechanism around its gap has only a few openings of this size.
SAME_SIZE, FEWEST_OTHERS = 2.5, 5

LETTERS = NoGap(
    Status.NO_FINGERS,
    "The object between the two supposed fingers is one of several objects of the same size, as in a text: give the "
    "region of the two fingers (--roi).",
)


_same_size = loop("gap_company_same_size")


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

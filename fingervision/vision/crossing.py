"""Detection of an object, such as a cable, that crosses the fingers and hides their ends in the binary picture.

If an object crosses the fingers, their apparent tips are the edge of this object. Beyond a true tip there is background
or some other object; a piece of the same width that continues along the same two lines is the finger itself.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gap import NoGap
from fingervision.domain.loops import loop
from fingervision.domain.status import Status
from fingervision.vision.coarse_fingers import CoarseFinger, CoarseFingers

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

_rows_beyond = loop("crossing_rows_beyond")


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

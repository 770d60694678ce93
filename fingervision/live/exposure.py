"""Check of the illumination in the picture: overexposed, too dark, or fluctuating."""

from collections import deque
from typing import Any

import numpy as np

from fingervision.domain.frame import Frame
from fingervision.vision.grey import full_scale, to_grey

# Every eighth pixel along both axes is sufficient.
STEP_PX = 8
# A white background is usual, but a picture of which a larger share is white shows no fingers.
WHITE_SHARE = 0.99
# If the 99th percentile of the grey levels is below this share of full scale, the contrast is low.
DARK_SHARE, BRIGHTEST_PERCENT = 0.25, 99.0
# The brightest parts are the background; it may change by at most this share of full scale over 50 frames.
CHANGE_SHARE, FRAMES_LOOKED_AT = 0.05, 50


class Exposure:
    """Checks the illumination from frame to frame."""

    def __init__(self) -> None:
        self._ground: deque[float] = deque(maxlen=FRAMES_LOOKED_AT)
        self.words = ""

    def add(self, frame: Frame) -> None:
        """Add a frame to the check; afterwards `words` states the problem, or is empty."""
        sparse: Any = np.ascontiguousarray(frame.pixels[::STEP_PX, ::STEP_PX])
        grey = to_grey(sparse)
        scale = full_scale(grey)
        brightest = int((grey.size - 1) * BRIGHTEST_PERCENT / 100.0)
        ground = float(np.partition(grey, brightest, axis=None)[brightest]) / scale
        self._ground.append(ground)
        if np.count_nonzero(grey == scale) > WHITE_SHARE * grey.size:
            self.words = "The picture is saturated: lower the exposure or the light."
        elif ground < DARK_SHARE:
            self.words = "The picture is too dark: raise the exposure or the light."
        elif max(self._ground) - min(self._ground) > CHANGE_SHARE:
            self.words = "The light is changing: switch off automatic exposure, or shield the set-up from other light."
        else:
            self.words = ""

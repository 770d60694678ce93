"""Drawn frames measured before the first real one: compiled code is then there, and no frame waits for it."""

from collections.abc import Callable
from threading import Timer

import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.region import Region
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

BELOW_TIP_PX, GAP_PX, FRAME_PX = 10.0, 60.0, (320, 240)
BORDER_PX = 8
# Loading what is compiled takes less; after an installation or another version it is compiled first.
SAID_AFTER_S = 3.0


def rehearse(say: Callable[[str, str], None]) -> None:
    """Measure drawn frames: both kinds of fingers in every direction, with a region and without.

    Parameters
    ----------
    say : callable
        Told a name and a sentence where it takes its time.
    """
    words = "Preparing to measure: after an installation this takes up to a minute, once."
    late = Timer(SAID_AFTER_S, say, ("preparing", words))
    late.daemon = True
    late.start()
    try:
        for direction in Direction:
            scene = two_fingers(
                GAP_PX, below_tip_px=BELOW_TIP_PX, radius_px=BELOW_TIP_PX, frame=FRAME_PX, direction=direction
            )
            dark = render(scene, Camera(blur_px=0.9, noise_grey=2.0), np.random.default_rng(0))
            whole = Region(0, 0, *FRAME_PX)
            part = Region(BORDER_PX, BORDER_PX, FRAME_PX[0] - 2 * BORDER_PX, FRAME_PX[1] - 2 * BORDER_PX)
            for pixels, region, known in ((dark, None, None), (255 - dark, part, direction), (dark, whole, direction)):
                measure_frame(Frame(pixels, 0, 0.0), Settings(BELOW_TIP_PX, known, region))
            # Where the fingers are sought in the wrong class, or hold something, a part between them is looked for.
            held = dark.copy()
            middle = (slice(FRAME_PX[1] // 4, FRAME_PX[1] // 2), slice(FRAME_PX[0] // 4, 3 * FRAME_PX[0] // 4))
            held[middle] = dark.min()
            for pixels in (dark, 255 - dark, held):
                for region in (None, part):
                    for known in (None, direction):
                        for is_dark in (True, False):
                            asked = Settings(BELOW_TIP_PX, known, region, fingers_are_dark=is_dark)
                            measure_frame(Frame(pixels, 0, 0.0), asked)
    finally:
        late.cancel()

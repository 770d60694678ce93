"""One drawn frame measured before the first real one: compiled code is then there, and no frame waits for it."""

from collections.abc import Callable
from threading import Timer

import numpy as np

from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

BELOW_TIP_PX, GAP_PX, FRAME_PX = 10.0, 60.0, (320, 240)
# Loading what is compiled takes less; after an installation or another version it is compiled first.
SAID_AFTER_S = 3.0


def rehearse(say: Callable[[str, str], None]) -> None:
    """Measure a drawn frame.

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
        scene = two_fingers(GAP_PX, below_tip_px=BELOW_TIP_PX, radius_px=BELOW_TIP_PX, frame=FRAME_PX)
        picture = render(scene, Camera(blur_px=0.9, noise_grey=2.0), np.random.default_rng(0))
        measure_frame(Frame(picture, 0, 0.0), Settings(BELOW_TIP_PX))
    finally:
        late.cancel()

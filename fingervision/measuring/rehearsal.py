"""Warm-up: measure rendered frames first, so that no real frame is delayed by one-time initialisation."""

from functools import cache

import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.edge_filters import REACHES_PX, edge_filters
from fingervision.vision.pipeline import Settings, measure_frame

BELOW_TIP_PX, GAP_PX, FRAME_PX = 10.0, 60.0, (320, 240)


@cache
def rehearse() -> None:
    """Measure a rendered frame with the tips in every direction, and compute the filter tables for every blur.

    Once in a process: what it initialises stays.
    """
    for direction in Direction:
        scene = two_fingers(
            GAP_PX, below_tip_px=BELOW_TIP_PX, radius_px=BELOW_TIP_PX, frame=FRAME_PX, direction=direction
        )
        pixels = render(scene, Camera(blur_px=0.9, noise_grey=2.0), np.random.default_rng(0))
        measure_frame(Frame(pixels, 0, 0.0), Settings(BELOW_TIP_PX))
    for reach_px in REACHES_PX:
        edge_filters(reach_px)

"""Fingers whose outer sides leave the picture in the middle of a recording."""

import numpy as np
import pytest

import fingervision as fv
from fingervision.rendering import Camera, render, two_fingers

FRAME, WIDEST = (320, 240), 20


@pytest.mark.parametrize("seed", [11, 12])
def test_outer_sides_that_reach_the_border_do_not_displace_the_inner_ones(seed: int) -> None:
    """Beside an edge one pixel from the border no plateau is seen, and what is seen there resembles a bright band."""
    rng = np.random.default_rng(seed)
    gaps = [60.0 + 3.0 * (WIDEST - abs(number - WIDEST)) for number in range(2 * WIDEST)]
    pictures = [render(two_fingers(gap, frame=FRAME), Camera(blur_px=0.9, noise_grey=1.0), rng) for gap in gaps]
    found = [row.gap_px for row in fv.measure(pictures, px_per_mm=34.0)]
    assert None not in found
    assert np.max(np.abs(np.array(found, dtype=float) - gaps)) < 0.05

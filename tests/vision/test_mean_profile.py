"""The mean profile of few rows of a slanted flank is told to be missing instead of being empty."""

from dataclasses import replace

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.mean_profile import mean_profile
from fingervision.vision.pipeline import Settings, look_closely
from fingervision.vision.profile_lines import INNER


@pytest.mark.parametrize("tilt_deg", [2.0, 5.0, 9.0])
def test_a_profile_is_never_empty(tilt_deg: float) -> None:
    scene = two_fingers(gap_px=120.0, tilt_deg=(tilt_deg, -tilt_deg), tip_at_px=120.0)
    picture = render(scene, Camera(blur_px=0.9, noise_grey=2.0), np.random.default_rng(3))
    _, _, edges = look_closely(Frame(picture, 0), Settings(10.0, Direction.UP))
    assert edges is not None
    rows = np.flatnonzero(edges.lines.weight[0, :INNER] > 0)
    empty = 0
    for count in range(11, rows.size):
        weight = np.zeros_like(edges.lines.weight)
        weight[0, rows[-count:]] = 1.0
        few = replace(edges, lines=replace(edges.lines, weight=weight))
        found = mean_profile(picture, few, np.arange(256.0), 0, slice(0, INNER), 20)
        assert found is None or found.t.size
        empty += found is None
    assert empty < rows.size - 11

"""Share of an edge bias at a round tip, tested with circles of decreasing size and on rendered fingers that bloom."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import FingerEdge, GapMeasurement
from fingervision.measuring.gap_budget import bias_shares
from fingervision.rendering.camera import Camera
from fingervision.rendering.picture import render
from fingervision.rendering.two_fingers import two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

BELOW_PX = 10.2


def half_width(radius_px: float) -> float:
    """Position and slope of a circle at a given distance below its top."""
    return sqrt(2.0 * radius_px * BELOW_PX - BELOW_PX**2)


def between_circles(radius_px: float) -> GapMeasurement:
    slope = (radius_px - BELOW_PX) / half_width(radius_px)
    edge = FingerEdge(100.0, 100.0, 89.8, 0.01, 0.01, slope, 0.9, 160.0)
    return GapMeasurement(edge, replace(edge, x_px=200.0, slope=-slope), Direction.UP, 0.01, True)


@pytest.mark.parametrize("radius_px", [12.0, 17.0, 34.0, 48.0])
def test_a_circle_that_shrinks_opens_the_gap_by_less_than_its_shrinking(radius_px: float) -> None:
    """Edge bias lowers the tip and the measuring height; the derivative of the half width gives the effect."""
    step = 1e-6
    opened = 2.0 * (half_width(radius_px) - half_width(radius_px - step)) / step  # per pixel of bloom on both sides
    assert bias_shares([between_circles(radius_px)])[0].sum() == pytest.approx(opened, rel=1e-4)


def test_straight_edges_take_all_of_the_bias() -> None:
    straight = between_circles(BELOW_PX)  # met at its equator, where the edge runs along the axis
    assert bias_shares([straight])[0] == pytest.approx([1.0, 1.0], abs=1e-12)


@pytest.mark.parametrize("radius_px", [10.0, 17.0, 48.0])
def test_a_gap_between_rendered_fingers_that_bloom_is_that_of_the_drawing(radius_px: float) -> None:
    bloom_px, gap_px = 0.3, 60.0  # the drawn gap, at the measuring height of fingers that do not bloom
    scene = two_fingers(gap_px, below_tip_px=BELOW_PX, radius_px=radius_px, centre_px=3.3, tip_at_px=150.3)
    picture = render(scene, Camera(blur_px=0.9, noise_grey=0.0, bloom_px=bloom_px), np.random.default_rng(1))
    found = measure_frame(Frame(picture, 0), Settings(below_tip_px=BELOW_PX))
    assert isinstance(found, GapMeasurement)
    assert found.gap_px - 2.0 * bloom_px * bias_shares([found]).mean() == pytest.approx(gap_px, abs=0.02)

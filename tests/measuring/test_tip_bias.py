"""Part of an edge bias that a round tip compensates, tested with circles of decreasing size."""

from dataclasses import replace
from math import sqrt

import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.gap import FingerEdge, GapMeasurement
from fingervision.measuring.tip_bias import u_tip_bias_mm

BELOW_PX = 10.2
PX_PER_MM = 34.0


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
    b = -2.0  # one pixel of bloom an edge
    expected = abs(b) * (1.0 - opened / 2.0) / PX_PER_MM
    assert u_tip_bias_mm([between_circles(radius_px)], b, PX_PER_MM)[0] == pytest.approx(expected, rel=1e-4)


def test_straight_edges_take_all_of_the_bias() -> None:
    straight = between_circles(BELOW_PX)  # met at its equator, where the edge runs along the axis
    assert u_tip_bias_mm([straight], 0.6, PX_PER_MM)[0] == pytest.approx(0.0, abs=1e-12)

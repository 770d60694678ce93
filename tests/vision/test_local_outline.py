"""Measuring points of exactly known smooth outlines: circles and ellipses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.vision.local_outline import local_edge, local_tip
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.profile_lines import INNER_SIDE, TIP_SIDE

# What a polynomial of fourth degree leaves of a circle of 30 px over 12 px to either side: s^6 / (16 R^5).
QUARTIC_PX = 0.012


def _circle(radius: float, x0: float, y0: float, blur: float = 0.0, u: float = 0.01) -> OutlinePoints:
    """Half-level outline of a blurred disc, located in rows where it is steep and in columns where it is flat."""
    seen = radius - 0.5 * blur**2 / radius
    flat = np.arange(np.ceil(x0 - 0.7 * seen), x0 + 0.7 * seen)
    steep = np.arange(np.ceil(y0 - 0.7 * seen), y0 + 0.7 * seen)
    x = np.concatenate((flat, x0 + np.sqrt(seen**2 - (steep - y0) ** 2)))
    y = np.concatenate((y0 - np.sqrt(seen**2 - (flat - x0) ** 2), steep))
    side = np.where(np.arange(len(x)) < len(flat), TIP_SIDE, INNER_SIDE)
    return OutlinePoints(x, y, np.full(len(x), u), side, np.full(len(x), blur))


@given(radius=st.floats(30.0, 60.0), x0=st.floats(-0.5, 0.5), y0=st.floats(-0.5, 0.5), blur=st.floats(0.3, 2.5))
def test_the_tip_of_a_blurred_circle_is_that_of_the_circle(radius: float, x0: float, y0: float, blur: float) -> None:
    tip = local_tip(_circle(radius, x0, y0, blur), x0 + 2.0, y0 - radius + 1.0, blur)
    assert tip is not None
    assert tip.y == pytest.approx(y0 - radius, abs=QUARTIC_PX)


@given(radius=st.floats(30.0, 60.0), x0=st.floats(-0.5, 0.5), y0=st.floats(-0.5, 0.5), blur=st.floats(0.3, 2.5))
def test_the_edge_of_a_blurred_circle_and_its_slope(radius: float, x0: float, y0: float, blur: float) -> None:
    depth = 10.2
    inside = radius - depth
    half = np.sqrt(radius**2 - inside**2)
    found = local_edge(_circle(radius, x0, y0, blur), x0 + half + 1.0, y0 - inside, inside / half, blur)
    assert found is not None
    edge, slope = found
    # Along the row the normal distance is stretched by the slope.
    assert edge.x == pytest.approx(x0 + half, abs=2.0 * QUARTIC_PX * np.hypot(1.0, inside / half))
    assert slope == pytest.approx(inside / half, rel=0.02)


def test_too_few_points_are_no_outline() -> None:
    few = _circle(40.0, 0.0, 0.0)
    cut = OutlinePoints(*(getattr(few, name)[:8] for name in OutlinePoints.__slots__))
    assert local_tip(cut, 0.0, -40.0, 0.5) is None


def test_the_stated_uncertainty_of_a_tip_is_its_scatter() -> None:
    rng = np.random.default_rng(74)
    found = []
    for _ in range(300):
        exact = _circle(40.0, 0.3, 0.2, 0.9, u=0.05)
        flat = ~exact.is_row
        away = rng.normal(0, 0.05, len(exact.x))
        moved = OutlinePoints(exact.x + away * ~flat, exact.y + away * flat, exact.u, exact.side, exact.blur)
        tip = local_tip(moved, 0.0, -39.0, 0.9)
        assert tip is not None
        found.append((tip.y, tip.u_normal))
    y, u = np.array(found).T
    # 300 values know their spread to 4 %; the choice of the window by the residuals adds to it.
    assert y.std() == pytest.approx(np.sqrt(np.mean(u**2)), rel=0.3)

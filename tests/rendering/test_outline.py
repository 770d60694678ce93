"""Outlines: areas, parallel curves, inside and outside."""

from math import pi, radians, tan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingervision.rendering.outline import Arc, Line, Motion, Outline, disc
from fingervision.rendering.polygon import polygon

# Rounding of closed forms with coordinates of some hundred pixels.
AREA_PX2 = 1e-8

CONVEX = ((0.0, 0.0), (60.0, 5.0), (70.0, 40.0), (20.0, 55.0), (-8.0, 30.0))


def perimeter_px(outline: Outline) -> float:
    return sum(piece.length_px for piece in outline.pieces)


@settings(deadline=None)
@given(by_px=st.floats(1e-3, 30.0), radius_px=st.floats(0.0, 8.0))
def test_a_grown_convex_outline_gains_perimeter_and_a_disc(by_px: float, radius_px: float) -> None:
    """Steiner's formula: A + P d + pi d^2."""
    shape = polygon(CONVEX, (radius_px,) * 5)
    expected = shape.area_px2 + perimeter_px(shape) * by_px + pi * by_px**2
    assert shape.grown(by_px).area_px2 == pytest.approx(expected, abs=AREA_PX2)


@settings(deadline=None)
@given(by_px=st.floats(0.01, 5.0))
def test_a_shrunk_polygon_loses_perimeter_less_its_corners(by_px: float) -> None:
    shape = polygon(CONVEX)
    corners = sum(
        tan(((b.heading_rad(0.0) - a.heading_rad(0.0)) % (2 * pi)) / 2)
        for a, b in zip(shape.pieces, shape.pieces[1:] + shape.pieces[:1], strict=True)
    )
    expected = shape.area_px2 - perimeter_px(shape) * by_px + corners * by_px**2
    assert shape.grown(-by_px).area_px2 == pytest.approx(expected, abs=AREA_PX2)


@settings(deadline=None)
@given(radius_px=st.floats(0.0, 8.0), turn_deg=st.floats(0.0, 360.0), x=st.floats(-100.0, 100.0), mirror=st.booleans())
def test_motions_keep_area_and_sense(radius_px: float, turn_deg: float, x: float, mirror: bool) -> None:
    shape = polygon(CONVEX, (radius_px,) * 5)
    placed = shape.moved(Motion.turn(radians(turn_deg))).moved(Motion(xx=-1.0 if mirror else 1.0, x_px=x, y_px=-x))
    assert placed.area_px2 == pytest.approx(shape.area_px2, abs=AREA_PX2)
    assert placed.backwards().area_px2 == pytest.approx(-shape.area_px2, abs=AREA_PX2)


def test_a_rounded_corner_cuts_a_square_less_a_quarter_disc() -> None:
    square = polygon(((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)), (2.0, 2.0, 2.0, 2.0))
    assert square.area_px2 == pytest.approx(100.0 - (4.0 - pi) * 4.0, abs=AREA_PX2)


@settings(deadline=None)
@given(seed=st.integers(0, 1000))
def test_winding_tells_inside_from_outside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-30.0, 80.0, (200, 2))
    round_one = disc(20.0, 25.0, 18.0)
    inside = np.hypot(points[:, 0] - 20.0, points[:, 1] - 25.0) < 18.0
    assert np.array_equal(round_one.winding(points), inside.astype(float))
    assert np.array_equal(round_one.backwards().winding(points), -inside.astype(float))
    square = polygon(((0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)), (0.0, 0.0, 20.0, 0.0))
    flat = (points > 0.0).all(axis=1) & (points < 40.0).all(axis=1)
    corner = (points > 20.0).all(axis=1) & (np.hypot(points[:, 0] - 20.0, points[:, 1] - 20.0) >= 20.0)
    assert np.array_equal(square.winding(points) > 0, flat & ~corner)


def test_parts_of_a_piece_meet() -> None:
    for piece in (Line(1.0, 2.0, 5.0, -3.0), Arc(1.0, 2.0, 5.0, 0.3, -2.0)):
        front, back = piece.part(0.0, 0.4), piece.part(0.4, 1.0)
        assert front.end == pytest.approx(back.start)
        assert front.length_px + back.length_px == pytest.approx(piece.length_px)
        assert piece.backwards().start == pytest.approx(piece.end)

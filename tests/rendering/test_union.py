"""Solids that overlap are one."""

from math import acos, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fingervision.rendering.outline import Motion, disc
from fingervision.rendering.polygon import polygon, union
from fingervision.rendering.two_fingers import two_fingers

# Rounding of closed forms with coordinates of some hundred pixels.
AREA_PX2 = 1e-7


@settings(deadline=None)
@given(distance_px=st.floats(3.1, 16.9), phase=st.floats(0.0, 6.28))
def test_two_discs_lose_their_common_lens_once(distance_px: float, phase: float) -> None:
    r, s, d = 10.0, 7.0, distance_px
    lens = r**2 * acos((d**2 + r**2 - s**2) / (2 * d * r)) + s**2 * acos((d**2 + s**2 - r**2) / (2 * d * s))
    lens -= sqrt((-d + r + s) * (d + r - s) * (d - r + s) * (d + r + s)) / 2
    discs = (disc(0.0, 0.0, r), disc(d * np.cos(phase), d * np.sin(phase), s))
    joined = union(discs)
    total = sum(outline.area_px2 for outline in joined)
    assert len(joined) == 1
    assert total == pytest.approx(discs[0].area_px2 + discs[1].area_px2 - lens, abs=AREA_PX2)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_a_point_is_inside_the_union_if_it_is_inside_any(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = tuple(
        polygon(((-20.0, -8.0), (20.0, -8.0), (20.0, 8.0), (-20.0, 8.0)), (rng.uniform(0.0, 8.0),) * 4)
        .moved(Motion.turn(rng.uniform(0.0, 6.28)))
        .moved(Motion(x_px=rng.uniform(-15.0, 15.0), y_px=rng.uniform(-15.0, 15.0)))
        for _ in range(3)
    )
    points = rng.uniform(-45.0, 45.0, (300, 2))
    inside = np.max([shape.winding(points) for shape in shapes], axis=0)
    assert np.array_equal(sum(outline.winding(points) for outline in union(shapes)), inside)


@settings(deadline=None)
@given(turn=st.floats(0.0, 6.28), x=st.floats(-200.0, 200.0))
def test_a_crossing_at_a_corner_is_not_lost(turn: float, x: float) -> None:
    """The corner of one square lies on the side of the other, whichever way it is rounded."""
    square = polygon(((-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0)))
    diamond = square.moved(Motion.turn(np.pi / 4)).moved(Motion(x_px=10.0, y_px=10.0 * np.sqrt(2.0)))
    pair = tuple(shape.moved(Motion.turn(turn)).moved(Motion(x_px=x, y_px=-x)) for shape in (square, diamond))
    # The diamond's upper corner is (10, 0) on the square's right side; its left upper side cuts the corner (10, 10).
    common = 10.0**2 / 2
    total = sum(outline.area_px2 for outline in union(pair))
    assert total == pytest.approx(800.0 - common, abs=1e-5)


@settings(deadline=None)
@given(gap_px=st.floats(-40.0, 18.0), radius_px=st.floats(20.0, 51.0), tilt_deg=st.floats(-3.0, 3.0))
def test_fingers_that_overlap_are_one_blob(gap_px: float, radius_px: float, tilt_deg: float) -> None:
    scene = two_fingers(gap_px, radius_px=radius_px, tilt_deg=(tilt_deg, -tilt_deg))
    left, right = (finger.outline for finger in scene.fingers)
    overlap = left.winding(np.array([[319.5, 300.0]]))[0] and right.winding(np.array([[319.5, 300.0]]))[0]
    assume(overlap)
    joined = union((left, right))
    assert sum(outline.area_px2 for outline in joined) < left.area_px2 + right.area_px2


@pytest.mark.parametrize("shift_px", [0.0, 3.0, 10.0])
def test_common_edges_are_counted_once_or_cancel(shift_px: float) -> None:
    """Two squares whose upper and lower sides lie on the same lines; at a shift of 10 px they touch along a side."""
    square = polygon(((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)), (2.0, 0.0, 0.0, 2.0))
    (joined,) = union((square, square.moved(Motion(xx=-1.0, x_px=20.0 - (10.0 - shift_px)))))
    missing = 4 * (4.0 - np.pi)
    assert joined.area_px2 == pytest.approx(
        10.0 * (10.0 + shift_px) - missing * (1.0 if shift_px >= 3.0 else 0.0), abs=AREA_PX2
    )
    # What is one solid grows as one.
    straight = [piece for piece in joined.pieces if piece.length_px > 1e-6]
    assert joined.grown(0.5).area_px2 > joined.area_px2
    assert sum(piece.length_px for piece in straight) < 2 * (10.0 + 10.0 + shift_px) + 1e-6


def test_an_outline_joined_with_itself_is_itself() -> None:
    shape = polygon(((0.0, 0.0), (10.0, 1.0), (12.0, 10.0), (0.0, 10.0)), (2.0, 1.0, 3.0, 2.0))
    (joined,) = union((shape, shape))
    assert joined.area_px2 == pytest.approx(shape.area_px2, abs=AREA_PX2)
    assert joined.grown(0.5).area_px2 == pytest.approx(shape.grown(0.5).area_px2, abs=AREA_PX2)


def test_what_does_not_overlap_stays_as_it_is() -> None:
    discs = (disc(0.0, 0.0, 5.0), disc(20.0, 0.0, 5.0))
    assert union(discs) is discs


def test_what_lies_inside_another_vanishes() -> None:
    large = disc(0.0, 0.0, 20.0)
    (joined,) = union((large, disc(2.0, 1.0, 5.0)))
    assert joined.area_px2 == pytest.approx(large.area_px2, abs=AREA_PX2)

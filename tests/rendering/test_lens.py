"""Tilt and lens: effect on points, and agreement of mapped outlines to 5e-6 px."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingervision.domain.frame import Region
from fingervision.rendering.camera import Camera, RadialLens, Tilt, View
from fingervision.rendering.finger import EllipticTip, finger_shape, half_ellipse
from fingervision.rendering.outline import Line, Outline, Piece, biarcs
from fingervision.rendering.picture import coverage
from fingervision.rendering.polygon import polygon

# Biarcs between exactly mapped points: the third power of their spacing times the change of curvature.
MAPPED_PX = 5e-6
# Rounding of points at some hundred pixels.
ROUNDING_PX = 1e-9

CENTRE = np.array([319.5, 239.5])


def view(lens: RadialLens | None = None, tilt: Tilt | None = None) -> View:
    return View(lens or RadialLens(), tilt or Tilt(), 640, 480)


def distance_px(pieces: tuple[Piece, ...], points: np.ndarray) -> np.ndarray:
    """Distance of each point from the nearest line or circle whose piece passes near it."""
    nearest = np.full(len(points), np.inf)
    for piece in pieces:
        near = np.hypot(*(points - piece.points(np.array([0.5]))[0]).T) < piece.length_px
        if isinstance(piece, Line):
            (x0, y0), (x1, y1) = piece.start, piece.end
            off = ((points[:, 0] - x0) * (y1 - y0) - (points[:, 1] - y0) * (x1 - x0)) / piece.length_px
        else:
            off = np.hypot(points[:, 0] - piece.x_px, points[:, 1] - piece.y_px) - abs(piece.radius_px)
        nearest = np.where(near, np.minimum(nearest, np.abs(off)), nearest)
    return nearest


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    k1=st.floats(-0.1, 0.1), k2=st.floats(-0.01, 0.02), about_x=st.floats(-20.0, 20.0), about_y=st.floats(-20.0, 20.0)
)
def test_a_mapped_outline_follows_the_mapped_points(k1: float, k2: float, about_x: float, about_y: float) -> None:
    seen = view(RadialLens(k1, k2), Tilt(about_x, about_y, 1500.0))
    shape = polygon(((80.0, 60.0), (500.0, 30.0), (600.0, 430.0), (120.0, 400.0)), (17.0, 0.0, 51.0, 5.0))
    mapped = seen.outline(shape)
    t = np.linspace(0.0, 1.0, 501)
    for piece in shape.pieces:
        assert np.max(distance_px(mapped.pieces, seen.points(piece.points(t)))) < MAPPED_PX


def test_the_corner_moves_by_k1_and_the_centre_stays() -> None:
    seen = view(RadialLens(k1=-0.05))
    assert np.max(np.abs(seen.points(CENTRE) - CENTRE)) < ROUNDING_PX
    corner = CENTRE + np.array([320.0, 240.0])
    assert np.max(np.abs(seen.points(corner) - (CENTRE + 0.95 * np.array([320.0, 240.0])))) < ROUNDING_PX


def test_a_tilted_plane_keeps_lines_straight_and_shrinks_with_depth() -> None:
    seen = view(tilt=Tilt(about_x_deg=10.0, about_y_deg=-15.0, distance_px=2000.0))
    line = seen.points(np.stack([np.linspace(50.0, 600.0, 21), np.linspace(20.0, 400.0, 21)], axis=-1))
    away = np.cross(line[-1] - line[0], line - line[0]) if line.shape[1] == 3 else None
    direction = line[-1] - line[0]
    away = (line - line[0]) @ np.array([-direction[1], direction[0]]) / np.hypot(*direction)
    assert np.max(np.abs(away)) < ROUNDING_PX
    # Positive about x moves the lower part away: it looks smaller.
    ends = seen.points(np.array([[200.0, 50.0], [400.0, 50.0], [200.0, 430.0], [400.0, 430.0]]))
    assert np.hypot(*(ends[1] - ends[0])) > np.hypot(*(ends[3] - ends[2]))
    # Negative about y moves the right part nearer: it looks larger.
    sides = seen.points(np.array([[100.0, 200.0], [100.0, 280.0], [540.0, 200.0], [540.0, 280.0]]))
    assert np.hypot(*(sides[3] - sides[2])) > np.hypot(*(sides[1] - sides[0]))


def test_biarcs_close_in_on_a_curve_with_the_third_power_of_the_spacing() -> None:
    def greatest_distance_px(count: int) -> float:
        t = np.linspace(0.2, 1.4, count)
        pieces = biarcs(
            np.stack([40 * np.cos(t), 90 * np.sin(t)], axis=-1), np.stack([-40 * np.sin(t), 90 * np.cos(t)], axis=-1)
        )
        fine = np.linspace(0.2, 1.4, 2001)
        return float(np.max(distance_px(pieces, np.stack([40 * np.cos(fine), 90 * np.sin(fine)], axis=-1))))

    assert greatest_distance_px(9) / greatest_distance_px(17) == pytest.approx(8.0, rel=0.15)


def test_a_half_ellipse_is_one_to_1e_3_px_and_has_its_area() -> None:
    arcs = half_ellipse(51.0, 70.0)
    angle = np.linspace(0.0, np.pi, 997)
    ellipse = np.stack([-51.0 * np.cos(angle), 70.0 * (1.0 - np.sin(angle))], axis=-1)
    assert np.max(distance_px(arcs, ellipse)) < 1e-3
    closed = Outline((*arcs, Line(51.0, 70.0, -51.0, 70.0)))
    assert closed.area_px2 == pytest.approx(np.pi * 51.0 * 70.0 / 2, rel=1e-5)
    assert finger_shape(102.0, 300.0, EllipticTip(70.0)).area_px2 > closed.area_px2


def test_what_the_camera_sees_is_drawn_where_it_lies() -> None:
    camera = Camera(lens=RadialLens(-0.08), tilt=Tilt(5.0, 10.0))
    (seen,) = camera.sees((polygon(((200.0, 100.0), (400.0, 120.0), (420.0, 300.0), (190.0, 330.0))),), 640, 480)
    drawn = coverage([seen], 0.9, Region(0, 0, 640, 480))
    assert drawn.sum() == pytest.approx(seen.area_px2, abs=1e-3)

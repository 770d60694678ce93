"""Covered fractions of pixels, compared with closed forms and direct integration over the area."""

from math import cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import erf

from fingervision.domain.frame import Region
from fingervision.rendering.outline import Motion, disc
from fingervision.rendering.picture import coverage
from fingervision.rendering.polygon import polygon

# The Gaussian's tail beyond REACH_SIGMAS, left out on both sides, holds 6e-7; what is left of it here is a sixth.
COVERED = 3e-7
# A rendered edge may lie this far from its outline. COVERED over the steepest slope at 5 px of blur, 1/(5 sqrt(2 pi)),
# is 4e-6 px.
EDGE_PX = 1e-5
# The required accuracy of an edge.
REQUIRED_PX = 1e-3

WIDTH, HEIGHT = 48, 40
WINDOW = Region(0, 0, WIDTH, HEIGHT)

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def pixel_mean_of_half_plane(blur_px: float, angle_rad: float, at_px: float) -> NDArray[np.float64]:
    """Blurred half plane n . p < at, averaged over each pixel by Gauss-Legendre in both directions."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    mean = np.zeros((HEIGHT, WIDTH))
    # Four panels each way: a blur of 0.3 px needs them.
    for panel in range(16):
        for a, wa in zip(_NODES, _WEIGHTS, strict=True):
            dx = ((panel % 4) + (a + 1) / 2) / 4 - 0.5
            dy = ((panel // 4) + (_NODES + 1) / 2) / 4 - 0.5
            distance = cos(angle_rad) * (x + dx)[..., None] + sin(angle_rad) * (y[..., None] + dy) - at_px
            inside = 0.5 * (1.0 - erf(distance / (blur_px * sqrt(2.0))))
            mean += wa * (inside @ _WEIGHTS) / 64
    return mean


def half_plane(angle_rad: float, at_px: float) -> list:
    far = 150.0
    square = polygon(((-far, -far), (0.0, -far), (0.0, far), (-far, far)))
    return [
        square.moved(Motion.turn(angle_rad)).moved(Motion(x_px=at_px * cos(angle_rad), y_px=at_px * sin(angle_rad)))
    ]


@pytest.mark.parametrize(
    ("blur_px", "angle_deg"), [(0.3, 0.2), (0.3, 45.0), (0.5, 8.0), (0.9, 137.0), (2.0, 0.0), (5.0, 90.0)]
)
def test_a_straight_edge_is_the_integrated_error_function(blur_px: float, angle_deg: float) -> None:
    angle = radians(angle_deg)
    at_px = 23.37 * cos(angle) + 19.81 * sin(angle)
    drawn = coverage(half_plane(angle, at_px), blur_px, WINDOW)
    expected = pixel_mean_of_half_plane(blur_px, angle, at_px)
    assert np.max(np.abs(drawn - expected)) < COVERED


@given(at_px=st.floats(18.0, 22.0), angle_deg=st.floats(-60.0, 60.0), blur_px=st.sampled_from([0.3, 0.9, 3.0, 5.0]))
@settings(max_examples=30, deadline=None)
def test_the_half_level_lies_on_the_outline(at_px: float, angle_deg: float, blur_px: float) -> None:
    """Newton's step from the pixel next to the outline, with the closed form for a vertical edge."""
    angle = radians(angle_deg)
    # A pixel whose middle lies on the edge is covered by half, at any angle: draw the edge through one.
    through = (20.0, 20.0)
    drawn = coverage(half_plane(angle, through[0] * cos(angle) + through[1] * sin(angle)), blur_px, WINDOW)
    slope = 1.0 / sqrt(2 * pi * (blur_px**2 + 1 / 12))
    assert abs(drawn[20, 20] - 0.5) / slope < EDGE_PX < REQUIRED_PX
    # And the row's sum is the edge's place, whatever the phase: a blur moves no area.
    upright = coverage(half_plane(0.0, at_px), blur_px, Region(-40, 0, 120, 4))
    ends = coverage(half_plane(0.0, at_px + 1.0), blur_px, Region(-40, 0, 120, 4))
    assert np.max(np.abs((ends - upright).sum(axis=1) - 1.0)) < EDGE_PX


def pixel_mean_of_disc(blur_px: float, x_px: float, y_px: float, radius_px: float) -> NDArray[np.float64]:
    """Blurred disc averaged over each pixel, as an area: a sum over its chords."""

    def step(t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Primitive of the pixel's kernel along one axis."""

        def ramp(u: NDArray[np.float64]) -> NDArray[np.float64]:
            gauss = np.exp(-0.5 * (u / blur_px) ** 2) * blur_px / sqrt(2 * pi)
            return u * 0.5 * (1 + erf(u / (blur_px * sqrt(2)))) + gauss

        return ramp(t + 0.5) - ramp(t - 0.5)

    def kernel(t: NDArray[np.float64]) -> NDArray[np.float64]:
        return 0.5 * (erf((t + 0.5) / (blur_px * sqrt(2))) - erf((t - 0.5) / (blur_px * sqrt(2))))

    nodes, weights = np.polynomial.legendre.leggauss(400)
    angle = nodes * pi / 2
    chord_y, half, d_y = (
        radius_px * np.sin(angle),
        radius_px * np.cos(angle),
        radius_px * np.cos(angle) * weights * pi / 2,
    )
    columns, rows = np.arange(WIDTH)[:, None], np.arange(HEIGHT)[:, None]
    across = step(columns - x_px + half) - step(columns - x_px - half)
    along = kernel(rows - y_px - chord_y) * d_y
    return along @ across.T


@pytest.mark.slow
@pytest.mark.parametrize("blur_px", [0.3, 0.9, 3.0])
@pytest.mark.parametrize("radius_px", [0.5, 2.0, 13.7])
def test_a_disc_is_the_integral_over_its_chords(blur_px: float, radius_px: float) -> None:
    drawn = coverage([disc(22.3, 18.8, radius_px)], blur_px, WINDOW)
    assert np.max(np.abs(drawn - pixel_mean_of_disc(blur_px, 22.3, 18.8, radius_px))) < COVERED


def test_blur_moves_the_half_level_into_the_curve_by_sigma_squared_over_two_radii() -> None:
    """Shift of the half-level at a round tip (measuring.md, section 1)."""
    radius_px, blur_px = 17.0, 0.9
    # Any pixel whose middle lies at this distance from the disc's centre.
    shift_px = (blur_px**2 + 1 / 12) / (2 * radius_px)
    row = coverage([disc(20.0 - (radius_px - shift_px), 20.0, radius_px)], blur_px, WINDOW)[20]
    slope = 1.0 / sqrt(2 * pi * (blur_px**2 + 1 / 12))
    # The next term of the expansion is of the order sigma^4 / R^3 = 2e-4 px.
    assert abs(row[20] - 0.5) / slope < 3e-4
    assert shift_px == pytest.approx(0.0263, abs=1e-4)


@given(
    x=st.floats(15.0, 30.0), y=st.floats(15.0, 25.0), turn_deg=st.floats(0.0, 360.0), blur_px=st.floats(0.3, 1.5),
    radius_px=st.floats(0.0, 2.5),
)  # fmt: skip
@settings(max_examples=30, deadline=None)
def test_the_covered_sum_is_the_area(x: float, y: float, turn_deg: float, blur_px: float, radius_px: float) -> None:
    shape = polygon(((-6.0, -3.0), (6.0, -3.0), (4.0, 3.0), (-5.0, 4.0)), (radius_px,) * 4)
    placed = shape.moved(Motion.turn(radians(turn_deg))).moved(Motion(x_px=x, y_px=y))
    # The whole frame's tails: COVERED on each pixel at most.
    assert coverage([placed], blur_px, WINDOW).sum() == pytest.approx(shape.area_px2, abs=1e-4)


def test_a_window_is_a_piece_of_the_frame() -> None:
    shape = [disc(20.0, 18.0, 15.0)]
    whole = coverage(shape, 0.9, WINDOW)
    part = coverage(shape, 0.9, Region(7, 11, 13, 17))
    assert np.max(np.abs(part - whole[11:28, 7:20])) < COVERED


@pytest.mark.parametrize("blur_px", [0.3, 2.0])
def test_mirrored_turned_and_shifted_outlines_give_mirrored_turned_and_shifted_pictures(blur_px: float) -> None:
    shape = polygon(((5.2, 4.1), (22.7, 7.3), (17.9, 21.4), (8.8, 17.0)), (2.0, 0.0, 4.0, 1.0))
    square = Region(0, 0, 30, 30)
    drawn = coverage([shape], blur_px, square)
    mirrored = coverage([shape.moved(Motion(xx=-1.0, x_px=29.0))], blur_px, square)
    turned = coverage([shape.moved(Motion(0.0, 1.0, 1.0, 0.0))], blur_px, square)
    shifted = coverage([shape.moved(Motion(x_px=3.0, y_px=-2.0))], blur_px, Region(3, -2, 30, 30))
    assert np.max(np.abs(drawn[:, ::-1] - mirrored)) < COVERED
    assert np.max(np.abs(drawn.T - turned)) < COVERED
    assert np.max(np.abs(drawn - shifted)) < COVERED


def test_a_hole_takes_away_what_a_solid_gives() -> None:
    plate, hole = disc(20.0, 20.0, 15.0), disc(22.0, 19.0, 6.0)
    both = coverage([plate, hole.backwards()], 0.9, WINDOW)
    assert np.max(np.abs(both - coverage([plate], 0.9, WINDOW) + coverage([hole], 0.9, WINDOW))) < COVERED


def test_shapes_beyond_the_frame_cover_nothing_and_a_shape_around_it_everything() -> None:
    beyond = [disc(-40.0, 20.0, 9.0), disc(20.0, -40.0, 9.0), disc(90.0, 90.0, 9.0)]
    assert np.max(np.abs(coverage(beyond, 0.9, WINDOW))) < COVERED
    around = coverage([disc(20.0, 20.0, hypot(WIDTH, HEIGHT) + 10.0)], 0.9, WINDOW)
    assert np.max(np.abs(around - 1.0)) < COVERED

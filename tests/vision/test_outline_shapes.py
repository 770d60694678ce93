"""Ends of fingers as chains of sides: contour of a blurred corner, shapes by evidence, and what lies between them."""

from itertools import pairwise
from math import cos, pi, sin

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.stats import multivariate_normal, norm

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.chain import U_PLACE_PX, Start, fit_chain
from fingervision.vision.finger_end import fit_from_any_radius
from fingervision.vision.first_guess import first_guess
from fingervision.vision.outline_points import OutlinePoints, finger_origin, outline_points
from fingervision.vision.outline_shapes import likely_points
from fingervision.vision.pipeline import measure_frame, steps_alone
from fingervision.vision.polygon import Side
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE, TIP_SIDE
from fingervision.vision.settings import Settings
from tests.benchmarks.finger_tips import LENGTH_PX, filled

BELOW_PX = 10.2
WIDTH_PX = 80.0
# Blur of the drawn pictures (Gaussian sigma without the pixel's width), and place about which the fingers are turned.
BLUR_PX, CENTRE = 1.1, np.array([220.0, 105.0])


def _points(corners: list[tuple[float, float]], noise_px: float, rng: np.random.Generator) -> OutlinePoints:
    """Points of a finger whose inner flank is at x = 0: rows on steep sides, columns on flat ones."""
    found = []
    for (x0, y0), (x1, y1) in pairwise(corners):
        is_row = abs(y1 - y0) > abs(x1 - x0)
        low, high = sorted((y0, y1) if is_row else (x0, x1))
        at = np.arange(np.ceil(low) + 2.0, high - 2.0)  # blur rounds the contour near a corner
        if is_row:
            x, y = x0 + (at - y0) * (x1 - x0) / (y1 - y0), at
            side = INNER_SIDE if x0 + x1 > -WIDTH_PX else OUTER_SIDE
        else:
            x, y, side = at, y0 + (at - x0) * (y1 - y0) / (x1 - x0), TIP_SIDE
        found.append(np.column_stack((x, y, np.full(at.size, side))))
    x, y, side = np.vstack(found).T
    noise = noise_px * rng.standard_normal(x.size)
    x, y = x + noise * (side != TIP_SIDE), y + noise * (side == TIP_SIDE)
    return OutlinePoints(x, y, np.full(x.size, noise_px), side.astype(np.int64), np.full(x.size, 0.6))


def _cut(leg_px: float, deep_px: float) -> list[tuple[float, float]]:
    """Corners of a finger with two chamfers."""
    w = WIDTH_PX
    return [(-w, 60.0), (-w, deep_px), (-w + leg_px, 0.0), (-leg_px, 0.0), (0.0, deep_px), (0.0, 60.0)]


def _rounded(radius_px: float) -> list[tuple[float, float]]:
    """Corners of a finger with two fillets, as short sides."""
    turn = np.linspace(0.0, 0.5 * pi, 200)
    x, y = radius_px * (1.0 - np.cos(turn)), radius_px * (1.0 - np.sin(turn))
    outer = list(zip((x - WIDTH_PX).tolist(), y.tolist(), strict=True))
    return [(-WIDTH_PX, 60.0), *outer, *((-WIDTH_PX - px, py) for px, py in reversed(outer)), (0.0, 60.0)]


@pytest.mark.parametrize(("leg_px", "deep_px"), [(20.0, 20.0), (25.0, 6.0), (8.0, 24.0)])
def test_tip_and_edge_of_cut_corners_are_found_within_their_uncertainty(leg_px: float, deep_px: float) -> None:
    """Below the tip, the edge is that of the chamfer, or below the chamfer's end that of the flank."""
    truth = -leg_px * (1.0 - BELOW_PX / deep_px) if deep_px > BELOW_PX else 0.0
    errors = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        pair = [_points(_cut(leg_px, deep_px), 0.03, rng) for _ in range(2)]
        ends = [fit_from_any_radius(p, *first_guess(p, BELOW_PX)) for p in pair]
        for found in likely_points(pair, ends, (None, None), BELOW_PX, 1.0).points:
            assert found is not None
            assert abs(found.tip) < 0.1
            errors.append((found.edge - truth) / np.sqrt(found.covariance[1, 1]))
    assert np.sqrt(np.mean(np.square(errors))) < 1.6


@pytest.mark.parametrize("is_cut", [True, False])
def test_a_rough_corner_is_found_whatever_it_is(is_cut: bool) -> None:
    """Where roughness half hides whether a corner is a fillet or a cut, the uncertainty holds both."""
    radius = 18.0
    leg = 0.655 * radius
    truth = -max(leg - BELOW_PX, 0.0) if is_cut else -(radius - np.sqrt(radius**2 - (radius - BELOW_PX) ** 2))
    rng = np.random.default_rng(2)
    corners = _cut(leg, leg) if is_cut else [(x, y) for x, y in _rounded(radius)]
    outline = np.array(corners)
    lengths = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(outline, axis=0).T))))
    at = np.linspace(0.0, lengths[-1], 400)
    fine = [(float(np.interp(s, lengths, outline[:, 0])), float(np.interp(s, lengths, outline[:, 1]))) for s in at]
    pair = []
    for _ in range(2):
        x, y = np.array(fine).T
        slope = np.abs(np.gradient(y)) > np.abs(np.gradient(x))
        side = np.where(~slope, TIP_SIDE, np.where(x > -0.5 * WIDTH_PX, INNER_SIDE, OUTER_SIDE)).astype(np.int64)
        noise = 0.2 * rng.standard_normal(x.size)
        x, y = x + noise * slope, y + noise * ~slope
        pair.append(OutlinePoints(x, y, np.full(x.size, 0.2), side, np.ones(x.size)))
    ends = [fit_from_any_radius(p, *first_guess(p, BELOW_PX)) for p in pair]
    for found in likely_points(pair, ends, (None, None), BELOW_PX, 1.0).points:
        assert found is not None
        assert found.tip == pytest.approx(0.0, abs=0.1)
        assert abs(found.edge - truth) < 2.5 * np.sqrt(found.covariance[1, 1])
        assert found.covariance[1, 1] < 0.3**2


@pytest.mark.parametrize("turn", [0.4, 0.5 * pi, 2.0])
def test_the_contour_of_a_sharp_corner_is_that_of_the_bivariate_normal(turn: float) -> None:
    """At the half-level, half of the light comes from the wedge, by the normal distribution over both of its sides."""
    sides = [Side(0.0, 0.0, -0.5 * turn), Side(0.0, 0.0, 0.5 * turn)]
    wedge = multivariate_normal([0.0, 0.0], [[1.0, cos(turn)], [cos(turn), 1.0]])
    low, high = 0.0, 6.0
    for _halving in range(40):  # of the depth below both sides
        depth = 0.5 * (low + high)
        low, high = (depth, high) if wedge.cdf(np.array([depth, depth])) < 0.5 else (low, depth)
    y = np.array([depth / cos(0.5 * turn)])
    points = OutlinePoints(np.zeros(1), y, np.ones(1), np.full(1, TIP_SIDE), np.ones(1))
    chain = fit_chain(points, Start(sides, [0.0], [U_PLACE_PX] * 2, [3.0]), 1.0, ())
    assert chain is not None
    assert chain.residual == pytest.approx(np.zeros(1), abs=1e-6)


@pytest.mark.parametrize("leg_px", [0.3125, 1.0125, 3.0125])  # between the raster's diagonals
def test_the_contour_of_a_cut_is_that_of_its_blurred_picture(leg_px: float) -> None:
    """Also where the cut is shorter than the blur, so that its corners have no contour of their own."""
    fine, blur_px = 40, 1.0
    x, y = np.meshgrid(*2 * [(np.arange(20 * fine) + 0.5) / fine - 10.0])
    is_inside = (x < 0.0) & (y > 0.0) & (y - x > leg_px)
    light = gaussian_filter(is_inside.astype(np.float64), blur_px * fine)
    along = np.linspace(-3.0, 3.0, 25)
    depth = np.linspace(-1.0, 4.0, 2001)[:, None]  # on lines at 45 degrees, between the two sides
    px, py = 0.5 * along - depth / np.sqrt(2.0), 0.5 * along + depth / np.sqrt(2.0)
    seen = map_coordinates(light, [(py + 10.0) * fine - 0.5, (px + 10.0) * fine - 0.5], order=1)
    at = np.array([np.interp(0.5, seen[:, k], depth[:, 0]) for k in range(along.size)])
    px, py = 0.5 * along - at / np.sqrt(2.0), 0.5 * along + at / np.sqrt(2.0)
    sides = [Side(-leg_px, 0.0, 0.0), Side(-leg_px, 0.0, 0.25 * pi), Side(0.0, leg_px, 0.5 * pi)]
    u_px = np.full(along.size, 10.0)  # beside which that of a corner is nothing
    points = OutlinePoints(px, py, u_px, np.full(along.size, TIP_SIDE), np.full(along.size, blur_px))
    chain = fit_chain(points, Start(sides, [0.0, 0.0], [U_PLACE_PX] * 3, [3.0] * 2), 1.0, ())
    assert chain is not None
    assert np.abs(chain.residual * u_px).max() < 2e-3


def _filled(outlines: list[np.ndarray], rng: np.random.Generator, noise: float = 2.0) -> np.ndarray:
    """Picture of dark polygons (pixels), with noise."""
    light = filled(outlines, BLUR_PX)
    levels = 200.0 - 160.0 * light + noise * rng.standard_normal(light.shape)
    return np.clip(np.round(levels), 0, 255).astype(np.uint8)


def _turned(drawn: np.ndarray, turn: float) -> np.ndarray:
    """Corners (n, 2) in the picture of corners relative to the middle between the tips."""
    return drawn @ np.array([[cos(turn), sin(turn)], [-sin(turn), cos(turn)]]) + CENTRE


@pytest.mark.parametrize("turned_deg", [1.0, 8.0])
def test_elliptical_ends_are_measured_and_not_called_rough(turned_deg: float) -> None:
    """The flanks of a half-ellipse are curved, but no parabolas; taken for rough ones, gaps were 1 to 2 px wrong."""
    turn, a, b, half_gap = np.radians(turned_deg), 20.0, 32.0, 47.3
    angles = np.linspace(0.0, pi, 200)
    drawn = np.column_stack([-a * np.cos(angles), b * (1.0 - np.sin(angles))])
    drawn = np.vstack([(-a, LENGTH_PX), drawn, (a, LENGTH_PX)])
    fingers = [_turned(drawn + np.array([side * (half_gap + a), 0.0]), turn) for side in (-1.0, 1.0)]
    outcome = measure_frame(Frame(_filled(fingers, np.random.default_rng(5), 1.5), 0), Settings(below_tip_px=BELOW_PX))
    assert isinstance(outcome, GapMeasurement), outcome.words
    truth = _gap_px(fingers)
    assert abs(outcome.gap_px - truth) < 3.0 * outcome.u_gap_px
    assert outcome.u_gap_px < 0.1


def _gap_px(fingers: list[np.ndarray]) -> float:
    """Distance between the inner sides of two outlines at the measuring height below each tip."""
    ends = []
    for corners, step in zip(fingers, (1, -1), strict=True):
        inner = corners[::step]
        height = float(inner[:, 1].min()) + BELOW_PX
        k = next(k for k in range(int(inner[:, 1].argmin()), len(inner)) if inner[k + 1, 1] >= height)
        (x0, y0), (x1, y1) = inner[k : k + 2]
        ends.append((x0 + (height - y0) * (x1 - x0) / (y1 - y0), height))
    return float(np.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]))


@pytest.mark.parametrize("turned_deg", [2.0, 9.0, -16.0])
@pytest.mark.parametrize("leg_px", [4.0, 9.0])
def test_chamfered_fingers_before_a_turned_camera_are_measured(leg_px: float, turned_deg: float) -> None:
    """Fillets in place of the cuts are up to 2 px wrong here; a cut of 4 px is hardly wider than the blur."""
    turn, rng = np.radians(turned_deg), np.random.default_rng(7)
    w = 60.0
    fingers = []
    for side in (-1.0, 1.0):
        own = [(-0.5 * w, leg_px), (-0.5 * w + leg_px, 0.0), (0.5 * w - leg_px, 0.0), (0.5 * w, leg_px)]
        drawn = np.array([(-0.5 * w, LENGTH_PX), *own, (0.5 * w, LENGTH_PX)])
        drawn[:, 0] += side * 77.3
        fingers.append(_turned(drawn, turn))
    truth = _gap_px(fingers)
    outcome = measure_frame(Frame(_filled(fingers, rng), 0), Settings(below_tip_px=BELOW_PX))
    assert isinstance(outcome, GapMeasurement), outcome.words
    assert abs(outcome.gap_px - truth) < 3.0 * float(np.hypot(outcome.u_gap_px, outcome.u_shift_px))


@pytest.mark.parametrize("turned_deg", [3.0, 9.0])
def test_lines_beside_a_corner_read_the_half_level_of_the_whole_finger(turned_deg: float) -> None:
    """A line that crosses a flank beside the corner runs along the top, and a step fitted to it is up to a blur away.

    The light at depths a and b inside the sides of a right-angled corner is Phi(a) Phi(b).
    """
    turn, w, half_gap = np.radians(turned_deg), 60.0, 47.3
    box = np.array([(0.0, LENGTH_PX), (0.0, 0.0), (w, 0.0), (w, LENGTH_PX)])
    fingers = [_turned(box + np.array([start, 0.0]), turn) for start in (-half_gap - w, half_gap)]
    seen = steps_alone(Frame(_filled(fingers, np.random.default_rng(5), 0.5), 0), Settings(below_tip_px=BELOW_PX))
    assert seen is not None
    (_, edges), _, coarse = seen
    for finger, points, inner in zip(
        (coarse.left, coarse.right), outline_points(coarse, edges), (-1.0, 1.0), strict=True
    ):
        across, along = finger_origin(finger)
        place = np.column_stack([finger.inner_sign * points.x + across, points.y + along]) - CENTRE
        x, below = (place @ np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])).T
        inside = (inner * x - half_gap) / BLUR_PX
        depth = below / BLUR_PX
        light = norm.cdf(inside) * norm.cdf(depth)
        slope = np.hypot(norm.pdf(inside) * norm.cdf(depth), norm.cdf(inside) * norm.pdf(depth))
        is_beside = (np.hypot(inside, depth) < 5.0) & (points.u < 0.5 * BLUR_PX)
        away_in_blurs = np.abs(light - 0.5)[is_beside] / slope[is_beside]
        assert away_in_blurs.size >= 4
        assert away_in_blurs.max() < 0.15

"""The three-sided end of a finger: its derivatives, and its fit to exact points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.vision.finger_end import fit_finger_end
from fingervision.vision.finger_shape import compared, corner_tops, inner_edge
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE, TIP_SIDE

# Central differences with steps of 1e-6 px.
DIFFERENCE = 1e-5
# The fit stops after a fixed number of steps.
EXACT_PX = 1e-3
ORIGIN = np.array([-40.0, 12.0])
# Optics so good that nothing of the outline's curvature is felt (pixels).
NO_BLUR = 1e-6

shapes = st.tuples(
    st.floats(-2.0, 2.0), st.floats(-83.0, -77.0), st.floats(-0.15, 0.15), st.floats(-0.15, 0.15),
    st.floats(6.0, 25.0), st.floats(6.0, 25.0), st.floats(-1.0, 1.0), st.floats(-0.15, 0.15),
).map(np.array)  # fmt: skip


def _compared(p: np.ndarray, points: OutlinePoints) -> tuple[np.ndarray, np.ndarray]:
    """Distances from a shape and their derivatives, in units of the points' uncertainties."""
    return compared(p, ORIGIN, points.x, points.y, points.u, points.is_row, points.x <= -40.0, points.blur)[:2]


def _points(x: np.ndarray, y: np.ndarray, is_row: np.ndarray, u_px: float = 1.0) -> OutlinePoints:
    side = np.where(is_row, np.where(x > -40.0, INNER_SIDE, OUTER_SIDE), TIP_SIDE)
    return OutlinePoints(x, y, np.full(x.shape, u_px), side, np.full(x.shape, NO_BLUR))


def _exact_points(p: np.ndarray) -> OutlinePoints:
    """Points of the outline, on rays from the finger's middle, found by bisection of the distance."""
    turn = np.linspace(-0.2, np.pi + 0.2, 240)
    dx, dy = np.cos(turn), -np.sin(turn)
    is_row = np.abs(dx) > np.abs(dy)
    low, high = np.zeros(turn.shape), np.full(turn.shape, 90.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        is_inside = _compared(p, _points(-40.0 + dx * middle, 35.0 + dy * middle, is_row))[0] < 0
        low, high = np.where(is_inside, middle, low), np.where(is_inside, high, middle)
    return _points(-40.0 + dx * low, 35.0 + dy * low, is_row, u_px=0.02)


@given(p=shapes)
def test_the_jacobian_is_that_of_finite_differences(p: np.ndarray) -> None:
    """The derivatives are tested on the outline, because Gauss-Newton neglects terms proportional to the distance from
    it.
    """
    exact, h = _exact_points(p), 1e-6
    points = _points(exact.x, exact.y, exact.is_row)
    _, found = _compared(p, points)
    for number in range(8):
        move = h * np.eye(8)[number]
        (up, by_up), (down, by_down) = (_compared(p + sense * move, points) for sense in (1, -1))
        # A point that changes sides has a kink between them.
        is_smooth = ((by_up != 0) == (by_down != 0)).all(axis=1)
        away = np.abs(found[:, number] - (up - down) / (2 * h))
        assert (away / (1.0 + np.abs(found[:, number])))[is_smooth].max() < DIFFERENCE


@given(p=shapes)
def test_an_exact_outline_is_recovered_exactly(p: np.ndarray) -> None:
    start = p + np.array([0.5, -0.5, 0.01, -0.01, 1.5, -1.5, 0.4, 0.01])
    found = fit_finger_end(_exact_points(p), start, ORIGIN, np.full(8, 1e3))
    tops = corner_tops(p, ORIGIN)
    height = min(tops[1], tops[3]) + 10.2
    # Edge and slope.
    assert inner_edge(found.parameters, ORIGIN, height) == pytest.approx(inner_edge(p, ORIGIN, height), abs=EXACT_PX)
    assert corner_tops(found.parameters, ORIGIN)[1::2] == pytest.approx(tops[1::2], abs=EXACT_PX)


@given(p=shapes, y=st.floats(3.0, 60.0))
def test_the_inner_edge_lies_on_the_outline(p: np.ndarray, y: float) -> None:
    x, _ = inner_edge(p, ORIGIN, y)
    if y > corner_tops(p, ORIGIN)[1] + 0.1:
        distance, _ = _compared(p, _points(np.array([x]), np.array([y]), np.array([True])))
        assert abs(float(distance[0])) < EXACT_PX


def test_every_seventh_point_being_dust_moves_nothing() -> None:
    p = np.array([0.0, -80.0, 0.02, -0.03, 14.0, 17.0, 0.0, 0.01])
    exact = _exact_points(p)
    rng = np.random.default_rng(75)
    is_dusty = rng.random(exact.x.shape) < 0.15
    dusty = OutlinePoints(
        exact.x + np.where(is_dusty & exact.is_row, rng.uniform(1, 4, exact.x.shape), 0.0),
        exact.y - np.where(is_dusty & ~exact.is_row, rng.uniform(1, 4, exact.x.shape), 0.0),
        exact.u, exact.side, exact.blur,
    )  # fmt: skip
    found = fit_finger_end(dusty, p + 0.2 * np.array([1, -1, 0, 0, 1, -1, 1, 0]), ORIGIN, np.full(8, 1e3))
    # Dust that the biweight leaves out has no say at all.
    assert inner_edge(found.parameters, ORIGIN, 10.2)[0] == pytest.approx(inner_edge(p, ORIGIN, 10.2)[0], abs=0.01)

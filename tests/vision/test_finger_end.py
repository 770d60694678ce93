"""The three-sided end: its derivatives, and its recovery from exact points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.vision.finger_end import (
    OutlinePoints,
    _jacobian,
    _place,
    _sides,
    corner_tops,
    fit_finger_ends,
    inner_edge,
)

# Central differences with steps of 1e-6 px.
DIFFERENCE = 1e-5
# The fit stops after a fixed number of steps.
EXACT_PX = 1e-3
ORIGIN = np.array([[-40.0, 12.0]])

shapes = st.tuples(
    st.floats(-2.0, 2.0), st.floats(-83.0, -77.0), st.floats(-0.15, 0.15), st.floats(-0.15, 0.15),
    st.floats(6.0, 25.0), st.floats(6.0, 25.0), st.floats(-1.0, 1.0), st.floats(-0.15, 0.15),
).map(lambda p: np.array([p]))  # fmt: skip


def _exact_points(p: np.ndarray) -> OutlinePoints:
    """Points of the outline itself, on rays from the finger's middle, by bisection of the distance."""
    sides = _sides(p, ORIGIN)
    turn = np.linspace(-0.2, np.pi + 0.2, 240)
    dx, dy = np.cos(turn), -np.sin(turn)
    low, high = np.zeros(turn.shape), np.full(turn.shape, 90.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        qx, qy = -40.0 + dx * middle, 35.0 + dy * middle
        ones = np.ones((1, len(turn)))
        probe = OutlinePoints(qx[None], qy[None], ones, ones > 0, ones, ones)
        is_inside = _place(sides, probe, (qx <= -40.0).astype(np.intp)[None]).distance[0] < 0
        low, high = np.where(is_inside, middle, low), np.where(is_inside, high, middle)
    x, y = (-40.0 + dx * low)[None], (35.0 + dy * low)[None]
    is_row = (np.abs(dx) > np.abs(dy))[None]
    return OutlinePoints(x, y, np.full(x.shape, 0.02), is_row, np.ones(x.shape), np.full(x.shape, 1e-3))


@given(p=shapes)
def test_the_jacobian_is_that_of_finite_differences(p: np.ndarray) -> None:
    """On the outline itself: away from it Gauss-Newton leaves out what is proportional to the distance."""
    points, h = _exact_points(p), 1e-6
    half = (points.x <= -40.0).astype(np.intp)
    sides = _sides(p, ORIGIN)
    at = _place(sides, points, half)
    found = _jacobian(at, sides, points, ORIGIN, 1.0 - half)[0]
    for number in range(8):
        move = h * np.eye(8)[number]
        up, down = (_place(_sides(p + s * move, ORIGIN), points, half) for s in (1, -1))
        # A point that changes sides has a kink between them.
        smooth = (up.on_fillet == down.on_fillet) & ((up.to_top > 0) == (down.to_top > 0))
        away = np.abs(found[number] - ((up.distance - down.distance) / (2 * h))[0])
        scale = 1.0 + np.abs(found[number])
        assert (away / scale)[smooth[0]].max() < DIFFERENCE


@given(p=shapes)
def test_an_exact_outline_is_recovered_exactly(p: np.ndarray) -> None:
    start = p + np.array([[0.5, -0.5, 0.01, -0.01, 1.5, -1.5, 0.4, 0.01]])
    found = fit_finger_ends(_exact_points(p), start, ORIGIN, np.full((1, 8), 1e3))
    height = corner_tops(p, ORIGIN)[1].min(axis=1) + 10.2
    truth, slope = inner_edge(p, ORIGIN, height)
    edge, found_slope = inner_edge(found.parameters, ORIGIN, height)
    assert edge[0] == pytest.approx(truth[0], abs=EXACT_PX)
    assert found_slope[0] == pytest.approx(slope[0], abs=EXACT_PX)
    assert corner_tops(found.parameters, ORIGIN)[1] == pytest.approx(corner_tops(p, ORIGIN)[1], abs=EXACT_PX)


@given(p=shapes, y=st.floats(3.0, 60.0))
def test_the_inner_edge_lies_on_the_outline(p: np.ndarray, y: float) -> None:
    x, _ = inner_edge(p, ORIGIN, np.array([y]))
    ones = np.ones((1, 1))
    probe = OutlinePoints(x[None], np.array([[y]]), ones, ones > 0, ones, ones)
    top = corner_tops(p, ORIGIN)[1][0, 0]
    if y > top + 0.1:
        place = _place(_sides(p, ORIGIN), probe, np.zeros((1, 1), dtype=np.intp))
        assert abs(float(place.distance[0, 0])) < EXACT_PX


def test_every_seventh_point_being_dust_moves_nothing() -> None:
    p = np.array([[0.0, -80.0, 0.02, -0.03, 14.0, 17.0, 0.0, 0.01]])
    exact = _exact_points(p)
    rng = np.random.default_rng(75)
    is_dusty = rng.random(exact.x.shape) < 0.15
    dusty = OutlinePoints(
        exact.x + np.where(is_dusty & exact.is_row, rng.uniform(1, 4, exact.x.shape), 0.0),
        exact.y - np.where(is_dusty & ~exact.is_row, rng.uniform(1, 4, exact.x.shape), 0.0),
        exact.u, exact.is_row, exact.weight, exact.blur,
    )  # fmt: skip
    found = fit_finger_ends(dusty, p + 0.2 * np.array([[1, -1, 0, 0, 1, -1, 1, 0]]), ORIGIN, np.full((1, 8), 1e3))
    edge, _ = inner_edge(found.parameters, ORIGIN, np.array([10.2]))
    truth, _ = inner_edge(p, ORIGIN, np.array([10.2]))
    # Dust that the biweight leaves out has no say at all.
    assert edge[0] == pytest.approx(truth[0], abs=0.01)

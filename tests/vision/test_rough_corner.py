"""A rough corner with chamfer or fillet: the measuring point agrees with the drawn shape within its uncertainty."""

import numpy as np
import pytest

from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE, TIP_SIDE
from fingervision.vision.rough_corner import with_corner_doubt

WIDTH, BELOW, RADIUS = 90.0, 10.0, 18.0
LEG = 0.655 * RADIUS
# Of the outline, by independent points (pixels).
ROUGH = 0.2


def outline(is_cut: bool, rng: np.random.Generator) -> OutlinePoints:
    """Points in rows and columns, with independent scatter, of an upright bar from x = -90 to 0, its top at y = 0."""
    y, x = np.arange(0.5, 50.0), np.arange(-WIDTH + 0.5, 0.0)

    def inset(d: np.ndarray) -> np.ndarray:
        if is_cut:
            return np.maximum(LEG - d, 0.0)
        return RADIUS - np.sqrt(np.maximum(RADIUS**2 - np.maximum(RADIUS - d, 0.0) ** 2, 0.0))

    rows, columns = y > 5.5, np.minimum(-x, x + WIDTH) > 5.5
    y, x = y[rows], x[columns]
    across = np.concatenate((-inset(y), -WIDTH + inset(y), x))
    down = np.concatenate((y, y, inset(np.minimum(-x, x + WIDTH))))
    side = np.concatenate((np.full(y.size, INNER_SIDE), np.full(y.size, OUTER_SIDE), np.full(x.size, TIP_SIDE)))
    scatter = ROUGH * rng.standard_normal(across.size)
    across += np.where(side == TIP_SIDE, 0.0, scatter)
    down += np.where(side == TIP_SIDE, scatter, 0.0)
    return OutlinePoints(across, down, np.full(across.size, ROUGH), side, np.ones(across.size))


def fillet_fit(points: OutlinePoints) -> FingerEnd:
    """The bar with fillets of the same area, and the distances of the points from its outline."""
    cx = np.clip(points.x, -WIDTH + RADIUS, -RADIUS)
    cy = np.maximum(points.y, RADIUS)
    away = np.hypot(points.x - cx, points.y - cy) - RADIUS
    shape = np.array((0.0, -WIDTH, 0.0, 0.0, RADIUS, RADIUS, 0.0, 0.0))
    return FingerEnd(shape, 1e-6 * np.eye(8), np.zeros(2), 1.0, away / points.u, np.ones(away.size))


@pytest.mark.parametrize("is_cut", [True, False])
def test_the_measuring_point_is_that_of_the_drawn_corner(is_cut: bool) -> None:
    fillet = RADIUS - np.sqrt(RADIUS**2 - (RADIUS - BELOW) ** 2)
    truth = -max(LEG - BELOW, 0.0) if is_cut else -fillet
    rng = np.random.default_rng(2)
    points = [outline(is_cut, rng) for _ in range(2)]
    start = MeasuringPoint(0.0, -20.0, -fillet, 0.5, 1e-4 * np.eye(2))
    found = with_corner_doubt(points, [fillet_fit(p) for p in points], [start, start], BELOW, 1.0)
    for own in found:
        assert own.tip == pytest.approx(0.0, abs=0.05)
        assert abs(own.edge - truth) < 2.5 * np.sqrt(own.covariance[1, 1])
        assert own.covariance[1, 1] < 0.3**2


def test_what_nothing_tells_is_in_the_uncertainty() -> None:
    """If all points share one error, the corner is undetermined: the result is half-way between the two shapes."""
    points = [outline(True, np.random.default_rng(3))] * 2
    start = MeasuringPoint(0.0, -20.0, -2.0, 0.5, 1e-4 * np.eye(2))
    found = with_corner_doubt(points, [fillet_fit(p) for p in points], [start, start], BELOW, 1e4)
    assert found[0].covariance[1, 1] > start.covariance[1, 1] + 0.01


def test_a_sharp_corner_is_left_alone() -> None:
    points = [outline(True, np.random.default_rng(4))] * 2
    ends = [fillet_fit(p) for p in points]
    for end in ends:
        end.parameters[4:6] = 1.0
    start = [MeasuringPoint(0.0, -20.0, -2.0, 0.5, 1e-4 * np.eye(2))] * 2
    assert with_corner_doubt(points, ends, start, BELOW, 1.0) == start

"""Fingers with chamfers: straight runs, half-level of a blurred corner, and tip and edge derived from the sides."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.polygon import corner_half_level
from fingervision.vision.polygonal_outline import polygonal_measuring_point, straight_runs
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE, TIP_SIDE

BELOW_PX = 10.2
# Standard deviation of the drawn points (pixels).
NOISE_PX = 0.03
# Depth of a half-level that the table of Owen's function knows (sigma).
DEPTH = 2e-3


def _chamfered(rng: np.random.Generator, cut_px: float, deep_px: float) -> OutlinePoints:
    """Points of a finger 80 px wide with two chamfers and its inner flank at x = 0: rows on flanks, columns on top."""
    corners = np.array(
        [(-80.0, 60.0), (-80.0, deep_px), (-80.0 + cut_px, 0.0), (-cut_px, 0.0), (0.0, deep_px), (0.0, 60.0)]
    )
    found = []
    for (x0, y0), (x1, y1) in pairwise(corners):
        is_row = abs(y1 - y0) > abs(x1 - x0)
        low, high = sorted((y0, y1) if is_row else (x0, x1))
        at = np.arange(np.ceil(low) + 1.0, high - 1.0)
        if is_row:
            x, y = x0 + (at - y0) * (x1 - x0) / (y1 - y0), at
            side = INNER_SIDE if x0 + x1 > -80.0 else OUTER_SIDE
        else:
            x, y, side = at, y0 + (at - x0) * (y1 - y0) / (x1 - x0), TIP_SIDE
        found.append(np.column_stack((x, y, np.full(at.size, side))))
    x, y, side = np.vstack(found).T
    noise = NOISE_PX * rng.standard_normal(x.size)
    side = side.astype(np.int64)
    x, y = x + noise * (side != TIP_SIDE), y + noise * (side == TIP_SIDE)
    return OutlinePoints(x, y, np.full(x.size, NOISE_PX), side, np.full(x.size, 0.6))


@pytest.mark.parametrize(("cut_px", "deep_px"), [(20.0, 20.0), (25.0, 6.0), (8.0, 24.0)])
def test_tip_and_edge_of_cut_corners_are_found_within_their_uncertainty(cut_px: float, deep_px: float) -> None:
    """Below the tip, the edge is that of the chamfer, or below the chamfer's end that of the flank."""
    truth = -cut_px * (1.0 - BELOW_PX / deep_px) if deep_px > BELOW_PX else 0.0
    errors = []
    for seed in range(12):
        found = polygonal_measuring_point(_chamfered(np.random.default_rng(seed), cut_px, deep_px), BELOW_PX, 1.0)
        assert found is not None
        assert abs(found.tip) < 0.1
        errors.append((found.edge - truth) / np.sqrt(found.covariance[1, 1]))
    assert np.sqrt(np.mean(np.square(errors))) < 1.6


def test_a_round_end_is_no_polygon() -> None:
    """A curved outline is refused, because it would need more sides than a finger has."""
    turn = np.linspace(-0.95 * pi, -0.05 * pi, 140)
    x, y = -40.0 + 40.0 * np.cos(turn), 40.0 + 40.0 * np.sin(turn)
    side = np.where(np.abs(np.cos(turn)) < 0.7, TIP_SIDE, np.where(x > -40.0, INNER_SIDE, OUTER_SIDE)).astype(np.int64)
    points = OutlinePoints(x, y, np.full(x.size, NOISE_PX), side, np.full(x.size, 1.0))
    assert polygonal_measuring_point(points, BELOW_PX, 1.0) is None


def test_runs_end_where_the_direction_changes() -> None:
    """Two lines with dust between them are two runs; one line with dust on it is one."""
    rng = np.random.default_rng(3)
    t = np.arange(40.0)
    bent = np.where(t < 20.0, 0.0, 0.3 * (t - 20.0)) + NOISE_PX * rng.standard_normal(40)
    assert [run.size for run in straight_runs(t, bent, np.full(40, NOISE_PX))] == pytest.approx([20, 20], abs=2)
    dusty = NOISE_PX * rng.standard_normal(40)
    dusty[18:21] += 3.0
    assert len(straight_runs(t, dusty, np.full(40, NOISE_PX))) == 1


@pytest.mark.parametrize("turn", [0.4, 0.5 * pi, 2.0])
def test_the_half_level_of_a_sharp_corner_is_that_of_the_bivariate_normal(turn: float) -> None:
    """At the half-level, half of the light comes from the wedge, by the normal distribution over both of its sides."""
    depth = float(corner_half_level(np.zeros(1), np.zeros(1), turn, 1.0)[0]) * np.cos(0.5 * turn)
    wedge = multivariate_normal([0.0, 0.0], [[1.0, np.cos(turn)], [np.cos(turn), 1.0]])
    assert wedge.cdf(np.array([depth, depth])) == pytest.approx(0.5, abs=DEPTH)

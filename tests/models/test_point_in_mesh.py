"""The motion of a point is that of the element in which the point lies."""

import numpy as np
import pytest

from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Ellipse, box
from fingervision.models.plane_stress import element_weights
from fingervision.models.triangulate import triangulate


def test_a_quadratic_field_is_met_on_curved_elements_and_beside_a_slit() -> None:
    """A frame with a slit of 0.1 mm, much finer than its elements: the two sides of the slit move differently."""
    steps = ((True, box(0, 40, 0, 40)), (False, Ellipse((20.0, 20.0), (6.0, 6.0), 0.0)), (False, box(-1, 13, 10, 10.1)))
    mesh = triangulate(PlanarRegion(steps), 1.0, 4.0)
    x, y = mesh.nodes_mm
    field = 1.0 + x - 2.0 * y + 0.3 * x**2 - 0.2 * x * y
    low = np.zeros(x.size, dtype=bool)
    low[mesh.triangles[:, mesh.nodes_mm[1, mesh.triangles].max(axis=0) <= 10.0 + 1e-9]] = True
    torn = np.where(low, field, field + 5.0)
    for point, jump in (((6.0, 10.0), 0.0), ((6.0, 10.1), 5.0), ((3.3, 4.4), 0.0), ((38.0, 37.0), 5.0)):
        nodes, weights = element_weights(mesh.nodes_mm, mesh.triangles, point)
        a, b = point
        wanted = 1.0 + a - 2.0 * b + 0.3 * a**2 - 0.2 * a * b + jump
        assert weights @ torn[nodes] == pytest.approx(wanted, abs=1e-9)
    at = (20.0 + 6.0 * np.cos(0.7), 20.0 + 6.0 * np.sin(0.7))
    nodes, weights = element_weights(mesh.nodes_mm, mesh.triangles, at)
    assert mesh.nodes_mm[:, nodes] @ weights == pytest.approx(at, abs=1e-12)

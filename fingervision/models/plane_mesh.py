"""A mesh of quadratic triangles in the plane, and the quality of its triangles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from fingervision.models.planar_region import PlanarRegion

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LEAST_QUALITY = 0.3
"""Least quality of a triangle: twice the ratio of inscribed to circumscribed radius, which is 1 for an equilateral
triangle and 0.7 for one with a 30-degree angle."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaneMesh:
    """Mesh of quadratic triangles in the plane; edges on the notches are curved.

    Parameters
    ----------
    nodes_mm : ndarray of float, shape (2, n)
        Positions of corners and edge midpoints.
    triangles : ndarray of int, shape (6, m)
        Node indices: corners 0, 1, 2 and the midpoints of the edges 01, 12, 02.
    """

    nodes_mm: NDArray[np.float64]
    triangles: NDArray[np.int64]

    def quality(self) -> Array:
        """Twice the ratio of inscribed to circumscribed radius of every triangle, shape (m,)."""
        return triangle_quality(self.nodes_mm, self.triangles[:3])


def inner_triangles(region: PlanarRegion, points: Array) -> Indices:
    """Delaunay triangles whose centroid lies in the body, anticlockwise; shape (3, m)."""
    triangles = Delaunay(points.T).simplices.T.astype(np.int64)
    middle = points[:, triangles].mean(axis=1)
    triangles = triangles[:, region.holds(middle)]
    a, b, c = (points[:, row] for row in triangles)
    twice = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
    triangles[:, twice < 0.0] = triangles[:, twice < 0.0][[0, 2, 1]]
    return np.asarray(triangles[:, np.abs(twice) > 1e-12 * np.sum((b - a) ** 2 + (c - a) ** 2, axis=0)])


def edges_of(triangles: Indices) -> Indices:
    """Every edge of the triangles, listed once; shape (2, k)."""
    pairs = np.sort(np.hstack([triangles[[0, 1]], triangles[[1, 2]], triangles[[0, 2]]]), axis=0)
    # Pairs coded as single numbers are sorted ten times as fast.
    count = int(triangles.max()) + 1
    return np.asarray(np.stack(np.divmod(np.unique(pairs[0] * count + pairs[1]), count)))


def triangle_quality(points: Array, triangles: Indices) -> Array:
    """Twice the ratio of inscribed to circumscribed radius; shape (m,)."""
    a, b, c = (points[:, row] for row in triangles)
    la, lb, lc = np.hypot(*(b - c)), np.hypot(*(c - a)), np.hypot(*(a - b))
    return np.asarray((lb + lc - la) * (lc + la - lb) * (la + lb - lc) / (la * lb * lc))

"""Place the nodes inside a body: seeded by the size field, moved by forces along the edges, settled at circumcentres.

Sources: Persson and Strang, A simple mesh generator in MATLAB, SIAM Review 46 (2004) 329; Alliez et al., Variational
tetrahedral meshing, ACM Transactions on Graphics 24 (2005) 617, in the plane.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingervision.models.mesh_size import SizeField
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_mesh import LEAST_QUALITY, edges_of, inner_triangles, triangle_quality

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MOST_NODES = 60_000
_OF_SQUARE = 0.93
"""Side of the square whose area is that of one node in a mesh of equilateral triangles with edge 1: sqrt(sqrt(3) /
2)."""
_PRESSURE = 1.2
"""Ratio of an edge's rest length to its wanted length: above 1 the nodes press against the outline (Persson and
Strang)."""
_STEP = 0.2
_ROUNDS, _MOVES_A_ROUND = 5, 6
_SETTLING = 3
_MENDING = 12
_CLEAR = 0.55
"""Initial distance of inner nodes from the outline's nodes, as a share of the edge length."""


def seeded_nodes(region: PlanarRegion, field: SizeField, outline: Array) -> Array:
    """Initial inner nodes: centres of squares that are divided down to the size that the size field requires."""
    low, high = outline.min(axis=1), outline.max(axis=1)
    side = float(field.body_mm)
    counts = np.ceil((high - low) / side).astype(int)
    grid = np.meshgrid(*(np.arange(c) for c in counts), indexing="ij")
    centres = low[:, None] + side * (np.stack([g.ravel() for g in grid]) + 0.5)
    random = np.random.default_rng(0)
    found = []
    tree = cKDTree(outline.T)
    while centres.size:
        wanted = field.at(centres)
        done = side <= _OF_SQUARE * wanted
        share = (side / (_OF_SQUARE * wanted[done])) ** 2
        found.append(centres[:, done][:, random.random(share.size) < share])
        rest = centres[:, ~done]
        # Drop squares whose centre is outside the body and far from the outline.
        near = tree.query(rest.T)[0] < 1.5 * side + 2.0 * wanted[~done] if rest.size else np.zeros(0, dtype=bool)
        rest = rest[:, near | region.holds(rest)]
        side *= 0.5
        shifts = 0.5 * side * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
        centres = (rest[:, :, None] + shifts.T[:, None, :]).reshape(2, -1)
        if centres.shape[1] > 8 * MOST_NODES:
            return np.asarray(centres)
    points = np.concatenate(found, axis=1)
    points = points[:, region.holds(points)]
    return _clear_of(points, outline, field)


def _clear_of(points: Array, outline: Array, field: SizeField) -> Array:
    if points.size == 0:
        return points
    return np.asarray(points[:, cKDTree(outline.T).query(points.T)[0] > _CLEAR * field.at(points)])


def relaxed_nodes(region: PlanarRegion, field: SizeField, outline: Array, inside: Array) -> tuple[Array, Indices]:
    """Move the inner nodes until the triangles are well shaped; return all nodes (outline first) and triangles."""
    fixed = outline.shape[1]
    points = np.concatenate([outline, inside], axis=1)
    at_outline = field.at(outline)
    for _ in range(_ROUNDS):
        triangles = inner_triangles(region, points)
        edges = edges_of(triangles)
        at_nodes = np.concatenate([at_outline, field.at(points[:, fixed:])])
        wanted = 0.5 * (at_nodes[edges[0]] + at_nodes[edges[1]])
        for _ in range(_MOVES_A_ROUND):
            way = points[:, edges[0]] - points[:, edges[1]]
            length = np.hypot(*way)
            scale = _PRESSURE * np.sqrt(np.sum(length**2) / np.sum(wanted**2))
            push = np.maximum(scale * wanted - length, 0.0) / length * way
            for axis in (0, 1):
                force = np.bincount(edges[0], push[axis], points.shape[1])
                force -= np.bincount(edges[1], push[axis], points.shape[1])
                points[axis, fixed:] += _STEP * force[fixed:]
        kept = np.concatenate([np.ones(fixed, dtype=bool), region.holds(points[:, fixed:])])
        points = points[:, kept]
    for _ in range(_SETTLING):
        triangles = inner_triangles(region, points)
        points = _settled(points, triangles, fixed)
    for _ in range(_MENDING):
        triangles = inner_triangles(region, points)
        bad = triangle_quality(points, triangles) < LEAST_QUALITY
        mended = _mended(points, triangles[:, bad], fixed)
        if mended is None:
            break
        points = mended
        for _ in range(2):
            points = _settled(points, inner_triangles(region, points), fixed)
    else:
        triangles = inner_triangles(region, points)
    return points, triangles


def _mended(points: Array, bad: Indices, fixed: int) -> Array | None:
    """Remove the inner node nearest to each flat triangle's longest side; return None if none can be removed."""
    if bad.shape[1] == 0:
        return None
    inner = np.unique(bad[bad >= fixed])
    if inner.size == 0:
        return None
    # Remove only one of several neighbouring nodes.
    taken: list[int] = []
    for place in inner.tolist():
        beside = bad[:, np.any(bad == place, axis=0)]
        if not set(beside.ravel().tolist()) & set(taken):
            taken.append(place)
    return np.delete(points, taken, axis=1)


def _settled(points: Array, triangles: Indices, fixed: int) -> Array:
    """Move every inner node to the area-weighted mean of its triangles' circumcentres, by a limited distance."""
    a, b, c = (points[:, row] for row in triangles)
    ab, ac = b - a, c - a
    twice = ab[0] * ac[1] - ab[1] * ac[0]
    ab2, ac2 = np.sum(ab**2, axis=0), np.sum(ac**2, axis=0)
    centre = a + np.stack([ac[1] * ab2 - ab[1] * ac2, ab[0] * ac2 - ac[0] * ab2]) / (2.0 * twice)
    # The circumcentre of a flat triangle lies far outside: use the centroid instead.
    flat = triangle_quality(points, triangles) < 0.5
    centre = np.where(flat, (a + b + c) / 3.0, centre)
    weight = np.abs(twice)
    total = np.bincount(triangles.ravel(), np.tile(weight, 3), points.shape[1])
    moved = points.copy()
    for axis in (0, 1):
        mean = np.bincount(triangles.ravel(), np.tile(weight * centre[axis], 3), points.shape[1])
        moved[axis, fixed:] = mean[fixed:] / np.maximum(total[fixed:], 1e-300)
    lost = total[fixed:] == 0.0
    moved[:, fixed:][:, lost] = points[:, fixed:][:, lost]
    return moved

"""Quadratic triangles of a plane body: exact outline, Delaunay triangulation, and nodes that repel each other.

The outline is divided into edges of the required size, and its nodes stay fixed. Inner nodes start on squares of the
required size and move under forces along the edges (Persson and Strang, A simple mesh generator in MATLAB, SIAM Review
46 (2004) 329), are triangulated again as they move, and are finally placed at the area-weighted mean of their
triangles' circumcentres (Alliez et al., Variational tetrahedral meshing, ACM Transactions on Graphics 24 (2005) 617, in
the plane). Midside nodes lie on the arcs of the outline.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import dist

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, cKDTree

from fingervision.domain.errors import ModelError
from fingervision.models.mesh_size import SizeField, size_field
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Curve, Outlined, Point

# A mesh of quadratic triangles in the plane, and the quality of its triangles.

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


def edges_of(triangles: Indices) -> tuple[Indices, Indices, Indices]:
    """Edges of the triangles, listed once, shape (2, k); the edge of every side, shape (3 m,); and sides per edge."""
    pairs = np.sort(np.hstack([triangles[[0, 1]], triangles[[1, 2]], triangles[[0, 2]]]), axis=0)
    count = int(triangles.max()) + 1
    numbers, place, times = np.unique(pairs[0] * count + pairs[1], return_inverse=True, return_counts=True)
    return np.stack(np.divmod(numbers, count)), place, times


def triangle_quality(points: Array, triangles: Indices) -> Array:
    """Twice the ratio of inscribed to circumscribed radius; shape (m,)."""
    a, b, c = (points[:, row] for row in triangles)
    la, lb, lc = np.hypot(*(b - c)), np.hypot(*(c - a)), np.hypot(*(a - b))
    return np.asarray((lb + lc - la) * (lc + la - lb) * (la + lb - lc) / (la * lb * lc))


# Division of a body's outline into edges of the lengths that the size field requires.


@dataclass(frozen=True, slots=True, eq=False)
class OutlineSide:
    """An edge of the outline between two of its nodes."""

    curve: Curve
    t0: float
    t1: float
    first: int
    second: int


def divided_outline(region: PlanarRegion, field: SizeField) -> list[OutlineSide]:
    """Divide every loop of the outline into edges of the length that the size field requires."""
    sides: list[OutlineSide] = []
    count = 0
    for loop in region.loops:
        begin = count
        spans = [(curve, a, b) for curve in loop.curves for a, b in pairwise(_stations(curve, field).tolist())]
        for place, (curve, a, b) in enumerate(spans):
            following = begin if place == len(spans) - 1 else count + 1
            sides.append(OutlineSide(curve, a, b, count, following))
            count += 1
    return sides


def _stations(curve: Curve, field: SizeField) -> Array:
    """Parameters that divide a curve into edges of the length that the size field requires."""
    t = np.linspace(curve.t0, curve.t1, 60)
    for _ in range(2):  # the second round takes four samples per edge
        at = curve.at(t)
        length = np.hypot(*np.diff(at, axis=1))
        edge = field.at(at)
        edges = np.concatenate([[0.0], np.cumsum(length * 0.5 * (1.0 / edge[1:] + 1.0 / edge[:-1]))])
        fine = np.linspace(0.0, edges[-1], max(60, int(4 * edges[-1])))
        t = np.interp(fine, edges, t)
    return np.asarray(np.interp(np.linspace(0.0, edges[-1], max(1, round(float(edges[-1]))) + 1), fine, t))


def outline_points(sides: list[OutlineSide]) -> Array:
    """Nodes of the outline, shape (2, k)."""
    points = np.zeros((2, len(sides)))
    for side in sides:
        points[:, side.first] = side.curve.at(np.array([side.t0]))[:, 0]
    return points


def halved(sides: list[OutlineSide], missing: set[int]) -> list[OutlineSide]:
    """Divide the given edges of the outline in two."""
    parts: list[OutlineSide] = []
    count = len(sides)
    for place, side in enumerate(sides):
        if place not in missing:
            parts.append(side)
            continue
        middle = 0.5 * (side.t0 + side.t1)
        parts += [OutlineSide(side.curve, side.t0, middle, side.first, count),
                  OutlineSide(side.curve, middle, side.t1, count, side.second)]  # fmt: skip
        count += 1
    return parts


def missing_sides(sides: list[OutlineSide], triangles: Indices) -> set[int]:
    """Indices of outline edges that belong to no triangle, or that have triangles on both sides."""
    edges, _, times = edges_of(triangles)
    once = set(zip(*edges[:, times == 1].tolist(), strict=True))
    return {place for place, side in enumerate(sides)
            if (min(side.first, side.second), max(side.first, side.second)) not in once}  # fmt: skip


def flat_sides(sides: list[OutlineSide], points: Array, triangles: Indices) -> set[int]:
    """Longest edges of flat triangles, if they are edges of the outline."""
    bad = triangles[:, triangle_quality(points, triangles) < LEAST_QUALITY]
    place_of = {frozenset((side.first, side.second)): place for place, side in enumerate(sides)}
    found = set()
    for triangle in bad.T.tolist():
        pairs = [(triangle[i], triangle[j]) for i, j in ((0, 1), (1, 2), (0, 2))]
        longest = max(pairs, key=lambda pair: dist(points[:, pair[0]], points[:, pair[1]]))
        if frozenset(longest) in place_of:
            found.add(place_of[frozenset(longest)])
    return found


def with_middles(points: Array, triangles: Indices, sides: list[OutlineSide]) -> PlaneMesh:
    """Renumber the used nodes and add midside nodes, which lie on the arcs where the outline is curved."""
    used, packed = np.unique(triangles, return_inverse=True)
    place_of = np.full(points.shape[1], -1)
    place_of[used] = np.arange(used.size)
    corners, triangles = points[:, used], packed.reshape(3, -1)
    edges, place, _ = edges_of(triangles)
    middles = 0.5 * (corners[:, edges[0]] + corners[:, edges[1]])
    place_of_edge = {(a, b): i for i, (a, b) in enumerate(edges.T.tolist())}
    for side in sides:
        if not side.curve.is_straight:
            a, b = sorted((int(place_of[side.first]), int(place_of[side.second])))
            middles[:, place_of_edge[a, b]] = side.curve.at(np.array([0.5 * (side.t0 + side.t1)]))[:, 0]
    mesh = PlaneMesh(
        np.concatenate([corners, middles], axis=1), np.vstack([triangles, used.size + place.reshape(3, -1)])
    )
    mesh.nodes_mm.flags.writeable = mesh.triangles.flags.writeable = False  # several models may hold it
    return mesh


_MENDING = 12

# Place the nodes inside a body: seeded by the size field, moved by forces along the edges, settled at circumcentres.
#
# Sources: Persson and Strang, A simple mesh generator in MATLAB, SIAM Review 46 (2004) 329; Alliez et al., Variational
# tetrahedral meshing, ACM Transactions on Graphics 24 (2005) 617, in the plane.

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
        edges, _, _ = edges_of(triangles)
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


__all__ = ["LEAST_QUALITY", "PlaneMesh", "triangulate"]

_REFINED = 4
"""Rounds of dividing the outline at flat triangles; at sharp corners of the outline triangles must stay flat."""
_MOST_KEPT = 8
"""Meshes that are kept: several kinds of model, and a corrected model beside its base, have the body of one drawing."""


def triangulate(region: PlanarRegion, across: float, body_mm: float) -> PlaneMesh:
    """Mesh a plane body.

    Parameters
    ----------
    region : PlanarRegion
        The body.
    across : float
        Number of triangles across thin material.
    body_mm : float
        Largest edge length.

    Raises
    ------
    ModelError
        If the body's finest part is so small compared with its size that too many triangles would be needed.
    """
    return _meshed(region.steps, region.marks_mm, across, body_mm)


@lru_cache(maxsize=_MOST_KEPT)
def _meshed(
    steps: tuple[tuple[bool, Outlined], ...], marks_mm: tuple[Point, ...], across: float, body_mm: float
) -> PlaneMesh:
    region = PlanarRegion(steps, marks_mm)
    field = size_field(region, across, body_mm)
    sides = divided_outline(region, field)
    refined = 0
    for _ in range(_MENDING):
        inside = seeded_nodes(region, field, outline_points(sides))
        if inside.shape[1] + len(sides) > MOST_NODES:
            raise ModelError(
                f"The body must be meshed by at most {MOST_NODES} nodes, but {inside.shape[1] + len(sides)} are "
                "needed: its thinnest part is too thin for the size of the body."
            )
        corners, triangles = relaxed_nodes(region, field, outline_points(sides), inside)
        missing = missing_sides(sides, triangles)
        if not missing and refined < _REFINED:
            # Flat triangles whose corners all lie on the outline show that its edges differ too much in length there.
            missing, refined = flat_sides(sides, corners, triangles), refined + 1
        if not missing:
            return with_middles(corners, triangles, sides)
        sides = halved(sides, missing)
    raise ModelError("The outline could not be meshed; check that its shapes do not nearly touch each other.")

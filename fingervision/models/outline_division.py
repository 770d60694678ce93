"""Division of a body's outline into edges of the lengths that the size field requires."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.models.mesh_size import SizeField
from fingervision.models.outline_curves import Curve
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_mesh import LEAST_QUALITY, PlaneMesh, triangle_quality

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


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
    pairs = np.sort(np.hstack([triangles[[0, 1]], triangles[[1, 2]], triangles[[0, 2]]]), axis=0)
    count = int(triangles.max()) + 1
    numbers, times = np.unique(pairs[0] * count + pairs[1], return_counts=True)
    once = set(zip(*(part.tolist() for part in np.divmod(numbers[times == 1], count)), strict=True))
    return {place for place, side in enumerate(sides)
            if (min(side.first, side.second), max(side.first, side.second)) not in once}  # fmt: skip


def flat_sides(sides: list[OutlineSide], points: Array, triangles: Indices) -> set[int]:
    """Longest edges of flat triangles, if they are edges of the outline."""
    bad = triangles[:, triangle_quality(points, triangles) < LEAST_QUALITY]
    place_of = {frozenset((side.first, side.second)): place for place, side in enumerate(sides)}
    found = set()
    for triangle in bad.T.tolist():
        pairs = [(triangle[i], triangle[j]) for i, j in ((0, 1), (1, 2), (0, 2))]
        longest = max(pairs, key=lambda pair: float(np.hypot(*(points[:, pair[0]] - points[:, pair[1]]))))
        if frozenset(longest) in place_of:
            found.add(place_of[frozenset(longest)])
    return found


def with_middles(points: Array, triangles: Indices, sides: list[OutlineSide]) -> PlaneMesh:
    """Renumber the used nodes and add midside nodes, which lie on the arcs where the outline is curved."""
    used, packed = np.unique(triangles, return_inverse=True)
    place_of = np.full(points.shape[1], -1)
    place_of[used] = np.arange(used.size)
    corners, triangles = points[:, used], packed.reshape(3, -1)
    pairs = np.sort(np.hstack([triangles[[0, 1]], triangles[[1, 2]], triangles[[0, 2]]]), axis=0)
    numbers, place = np.unique(pairs[0] * used.size + pairs[1], return_inverse=True)
    edges = np.stack(np.divmod(numbers, used.size))
    middles = 0.5 * (corners[:, edges[0]] + corners[:, edges[1]])
    place_of_edge = {(a, b): i for i, (a, b) in enumerate(edges.T.tolist())}
    for side in sides:
        if not side.curve.is_straight:
            a, b = sorted((int(place_of[side.first]), int(place_of[side.second])))
            middles[:, place_of_edge[a, b]] = side.curve.at(np.array([0.5 * (side.t0 + side.t1)]))[:, 0]
    nodes = np.concatenate([corners, middles], axis=1)
    return PlaneMesh(nodes, np.vstack([triangles, used.size + place.reshape(3, -1)]))

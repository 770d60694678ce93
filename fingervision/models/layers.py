"""Layers of a drawing: plates that lie on each other and are joined only by the bodies that are in several of them.

The parts of each layer are those of a plane drawing. Parts of different layers are one piece where a body joins the
layers; elsewhere they may lie over each other without touching.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from fingervision.domain.errors import DataError
from fingervision.models.planar_region import Loop, PlanarRegion
from fingervision.models.plane_shapes import Curve, Shape

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Joint = tuple[Shape, tuple[int, ...]]
"""A body that joins layers, and the numbers of its layers."""

_SAMPLES = 24
"""Test points along either side of the box round a shape, and of a triangle."""
_ENDS = 65
_IN_TRIANGLE = 4
"""Rows of the points in a triangle at which the layers there are counted."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A connected part of a plane body: its outline and its holes."""

    outline: Loop
    holes: tuple[Loop, ...]

    def holds(self, points: Array) -> Flags:
        """Whether points, shape (2, n), lie in the part; arcs are replaced by their chords."""
        inside = self.outline.holds(points)
        for hole in self.holes:
            inside = inside & ~hole.holds(points)
        return inside


def parts_of(region: PlanarRegion) -> list[Part]:
    """Divide a region into its connected parts, the largest first."""
    outer = [loop for loop in region.loops if loop.area_mm2 > 0.0]
    inner = [loop for loop in region.loops if loop.area_mm2 < 0.0]
    # A hole belongs to the smallest outline that contains the hole; loops are sorted by size.
    points = [hole.sides_mm[0][:, [_ENDS // 2]] for hole in inner]
    owners = [max(n for n, loop in enumerate(outer) if loop.holds(point)[0]) for point in points]
    return [
        Part(loop, tuple(hole for hole, owner in zip(inner, owners, strict=True) if owner == n))
        for n, loop in enumerate(outer)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A connected part of one layer, as a shape.

    Parameters
    ----------
    layer : int
        Number of the layer.
    region : PlanarRegion
        The whole layer.
    part : Part
        The part.
    others : tuple of Part
        The other parts of the layer.
    """

    layer: int
    region: PlanarRegion
    part: Part
    others: tuple[Part, ...]

    def curves(self) -> list[Curve]:
        """Curves of the outline and the holes."""
        return [curve for loop in (self.part.outline, *self.part.holes) for curve in loop.curves]

    def holds(self, points: Array) -> Flags:
        """Whether points, shape (2, n), lie in the part, beside its own arcs exactly."""
        inside = self.region.holds(points)
        for other in self.others:
            inside = inside & ~other.holds(points)
        return inside


def pieces_of(layers: Mapping[int, PlanarRegion], joints: Sequence[Joint]) -> list[tuple[Sheet, ...]]:
    """Divide layers into pieces: each is one sheet, or sheets of several layers that bodies join."""
    sheets = []
    for layer, region in layers.items():
        parts = parts_of(region)
        sheets += [Sheet(layer, region, part, (*parts[:n], *parts[n + 1 :])) for n, part in enumerate(parts)]
    if not sheets:
        return []
    pairs = [(n, n) for n in range(len(sheets))]
    for shape, numbers in joints:
        points = points_in(shape)
        points = points[:, np.all([layers[layer].holds(points) for layer in numbers], axis=0)]
        own = [n for n, sheet in enumerate(sheets) if sheet.layer in numbers]
        held = np.array([sheets[n].holds(points) for n in own])
        pairs += [(own[a], own[b]) for column in np.unique(held, axis=1).T for a, b in pairwise(np.flatnonzero(column))]
    rows, columns = np.array(pairs).T
    graph = coo_matrix((np.ones(rows.size), (rows, columns)), shape=(len(sheets), len(sheets)))
    count, piece = connected_components(graph, directed=False)
    return [tuple(sheet for sheet, at in zip(sheets, piece, strict=True) if at == n) for n in range(count)]


def plan_of(piece: Sequence[Sheet], marks_mm: tuple[tuple[float, float], ...]) -> PlanarRegion:
    """The plane region over which the sheets of a piece lie."""
    return PlanarRegion(tuple((True, sheet) for sheet in piece), marks_mm)


def layers_at(piece: Sequence[Sheet], joints: Sequence[Joint], corners_mm: Array, name: str) -> Array:
    """Mean number of layers of a piece in triangles, from their corners of shape (2, 3, m); shape (m,).

    Raises
    ------
    DataError
        If sheets of the piece lie over each other where no body joins them: the plane model of a piece has one
        displacement at every point.
    """
    a, b = np.meshgrid(*(2 * [(np.arange(_IN_TRIANGLE) + 1.0 / 3.0) / _IN_TRIANGLE]))
    a, b = a[a + b < 1.0], b[a + b < 1.0]
    points = np.einsum("ijm,jk->imk", corners_mm, np.stack([1.0 - a - b, a, b])).reshape(2, -1)
    held = {sheet.layer: sheet.holds(points) for sheet in piece}
    count = np.sum(list(held.values()), axis=0)
    joined = np.zeros(count.size, dtype=bool)
    for shape, numbers in joints:
        joined |= shape.holds(points) & (count <= len(numbers))
    middle = (count > 1) & ~joined
    if middle.reshape(corners_mm.shape[2], -1).all(axis=1).any():
        x, y = points[:, np.flatnonzero(middle)[0]]
        raise DataError(
            f"Parts of one body of {name} in layers {' and '.join(map(str, held))} must not lie over each other, but "
            f"do at ({x:.4g}, {y:.4g}) mm: state in_layers = {list(held)} for a body there, or join one by a flexure."
        )
    return np.asarray(np.maximum(count.reshape(corners_mm.shape[2], -1).mean(axis=1), 1.0))


def points_in(shape: Shape) -> Array:
    """Points of a grid that lie in a shape, shape (2, n)."""
    ends = np.concatenate([curve.at(np.linspace(curve.t0, curve.t1, _ENDS)) for curve in shape.curves()], axis=1)
    low, high = ends.min(axis=1), ends.max(axis=1)
    along = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    grid = np.stack(np.meshgrid(*(low[i] + along * (high[i] - low[i]) for i in range(2)))).reshape(2, -1)
    return np.asarray(grid[:, shape.holds(grid)])

"""Element size: a fraction of the material's width in thin parts, with limited growth between neighbouring elements."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingervision.models.planar_region import PlanarRegion, face_ends_mm, sharp_corners_mm
from fingervision.models.plane_shapes import Curve

Array = NDArray[np.float64]

_GROWTH = 0.3
"""Increase of edge length per distance: neighbouring edges differ by less than a third, and triangles are not
needlessly flat."""
_OF_RADIUS = 0.35
"""Largest ratio of edge length to radius of curvature: the sagitta is 1.5 % of the radius, and the quadratic edge
follows the arc to 1e-5 of the radius."""
_CLASS = 1.3
"""Largest ratio of edge lengths within a group of points; in each group only the nearest point is looked up."""
_SMALLEST = 1e-4
"""Smallest edge length, as a share of the body's size."""
_ALONG_NOTCH = 6.0
"""Triangles along the bending length of a notch, per triangle across it: with 4 across, the force of the published
sample is within 0.01 % of its limit."""
_FIRST_SAMPLES = 24
_AT_CORNER = 0.2
"""Edge length at re-entrant corners, as a share of the neighbouring edge length: the stress is singular there, and
without refinement the force of the published sample would be 0.1 % too high."""


@dataclass(frozen=True, eq=False)
class SizeField:
    """Edge lengths that grow with the distance from points of the outline.

    Parameters
    ----------
    points_mm : ndarray of float, shape (n, 2)
        Points of the outline.
    edge_mm : ndarray of float, shape (n,)
        Edge length at each point.
    body_mm : float
        Largest edge length.
    """

    points_mm: Array
    edge_mm: Array
    body_mm: float

    def at(self, points: Array) -> Array:
        """Edge length at points, shape (2, n)."""
        wanted = np.full(points.shape[1], self.body_mm)
        # Start with the finest class: a class does not matter at points where the edge length is already below its own.
        for tree, edge in self._classes:
            open_ = np.flatnonzero(wanted > edge.min())
            if open_.size == 0:
                break
            reach = (float(wanted[open_].max()) - float(edge.min())) / _GROWTH
            way, place = tree.query(points.T[open_], distance_upper_bound=reach)
            found = np.isfinite(way)
            own = open_[found]
            wanted[own] = np.minimum(wanted[own], edge[place[found]] + _GROWTH * way[found])
        return wanted

    @cached_property
    def _classes(self) -> list[tuple[cKDTree, Array]]:
        """Group points by edge length, so that within a group only the nearest point limits the mesh size."""
        rank = np.floor(np.log(self.edge_mm / self.edge_mm.min()) / np.log(_CLASS)).astype(int)
        return [(cKDTree(self.points_mm[rank == r]), self.edge_mm[rank == r]) for r in np.unique(rank)]


def size_field(region: PlanarRegion, across: float, body_mm: float) -> SizeField:
    """Measure the material's width at every point of the outline, perpendicular to it, and derive element sizes.

    Parameters
    ----------
    region : PlanarRegion
        The body.
    across : float
        Number of triangles across the material where it is thinner than `across` times `body_mm`.
    body_mm : float
        Largest edge length.
    """
    curves = [(loop, place, curve) for loop in region.loops for place, curve in enumerate(loop.curves)]
    every = [curve for _, _, curve in curves]
    points, sizes = [], []
    for loop, place, curve in curves:
        neighbours = {id(loop.curves[place - 1]), id(loop.curves[(place + 1) % len(loop.curves)]), id(curve)}
        others = [other for other in every if id(other) not in neighbours]
        t = curve.t0 + (curve.t1 - curve.t0) * np.linspace(0.0, 1.0, _FIRST_SAMPLES)
        size = _sizes(curve, t, others, across, body_mm, region.size_mm)
        # Space the samples as closely as the triangles, so that the mesh of a long leaf is fine over its whole length.
        length = _lengths(curve, t)
        # The edge length must fall gradually towards a short side between long sides of the outline.
        size = np.clip(np.minimum(size, length[-1]), _SMALLEST * region.size_mm, body_mm)
        count = int(min(2000.0, np.ceil(np.sum(np.diff(length) / np.minimum(size[1:], size[:-1])))))
        if count > _FIRST_SAMPLES:
            t = np.interp(np.linspace(0.0, length[-1], count), length, t)
            size = _sizes(curve, t, others, across, min(body_mm, length[-1]), region.size_mm)
        points.append(curve.at(t).T)
        sizes.append(size)
    for corner in (*sharp_corners_mm(region), *face_ends_mm(region)):
        near = [float(s[np.argmin(np.hypot(*(p - corner).T))]) for p, s in zip(points, sizes, strict=True)
                if np.hypot(*(p - corner).T).min() < _SMALLEST * region.size_mm]  # fmt: skip
        points.append(corner[None, :])
        sizes.append(np.array([_AT_CORNER * min([body_mm, *near])]))
    at, edge = np.concatenate(points), np.concatenate(sizes)
    thin = edge < body_mm
    return _thinned(at[thin], edge[thin], body_mm)


def _thinned(at: Array, edge: Array, body_mm: float) -> SizeField:
    """Remove points whose edge length already follows from that of other points."""
    order = np.argsort(edge)
    at, edge = at[order], edge[order]
    kept = np.ones(len(edge), dtype=bool)
    for place in range(len(edge)):
        if kept[place]:
            far = np.hypot(*(at[place + 1 :] - at[place]).T)
            near = far * 0.6 * _GROWTH + edge[place] <= edge[place + 1 :]
            kept[place + 1 :] &= ~(near | (far < 0.5 * edge[place]))
    if not kept.any():
        return SizeField(np.zeros((1, 2)), np.array([body_mm]), body_mm)
    return SizeField(at[kept], edge[kept], body_mm)


def _sizes(curve: Curve, t: Array, others: list[Curve], across: float, body_mm: float, size_mm: float) -> Array:
    at, along = curve.at(t), curve.direction(t)
    inward = np.stack([-along[1], along[0]])
    width = _ray_lengths(at, inward, [other for other in others if other.v is None], 1e-9 * size_mm)
    for other in others:
        if other.v is not None:
            width = np.minimum(width, _ray_length(at, inward, other, other.v, 1e-9 * size_mm))
    radius = curve.curvature_radius_mm(t)
    size = np.minimum(width / across, _OF_RADIUS * radius)
    # Bending is spread over sqrt(width radius) along a notch.
    size = np.minimum(size, np.sqrt(width) * np.sqrt(radius) / (_ALONG_NOTCH * across))
    return np.asarray(np.clip(size, _SMALLEST * size_mm, body_mm))


def _lengths(curve: Curve, t: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve.at(t), axis=1)))])


def _ray_lengths(at: Array, towards: Array, segments: list[Curve], least: float) -> Array:
    """Distance from points to the nearest of the segments along given directions; infinite where there is none."""
    if not segments:
        return np.full(at.shape[1], np.inf)
    origin, u = (np.array([getattr(each, name) for each in segments]).T[:, :, None] for name in ("origin", "u"))
    apart = at[:, None] - origin
    cross = towards[0] * u[1] - towards[1] * u[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        way = -(apart[0] * u[1] - apart[1] * u[0]) / cross
        t = (towards[0] * apart[1] - towards[1] * apart[0]) / cross
    hit = (np.abs(cross) > 1e-12 * np.hypot(*u)) & (way > least) & (t >= 0.0) & (t <= 1.0)
    return np.asarray(np.where(hit, way, np.inf).min(axis=0))


def _ray_length(at: Array, towards: Array, other: Curve, v: Array, least: float) -> Array:
    """Distance from points to an arc with the half axis v along given directions; infinite where the ray misses it."""
    apart = at - other.origin[:, None]
    frame = np.array([other.u, v]).T
    a, b = np.linalg.solve(frame, apart), np.linalg.solve(frame, towards)
    square, half, rest = np.sum(b * b, axis=0), np.sum(a * b, axis=0), np.sum(a * a, axis=0) - 1.0
    below = half**2 - square * rest
    root = np.sqrt(np.maximum(below, 0.0))
    best = np.full(at.shape[1], np.inf)
    low, high = sorted((other.t0, other.t1))
    for way in ((-half - root) / square, (-half + root) / square):
        c, s = a + way * b
        turn = np.mod(np.arctan2(s, c) - low, 2.0 * np.pi)
        hit = (below >= 0.0) & (way > least) & (turn <= high - low)
        best = np.where(hit & (way < best), way, best)
    return best

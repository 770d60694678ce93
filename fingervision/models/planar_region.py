"""A plane body as a sequence of shapes that are added or removed, with its exact outline of segments and arcs.

The outline of every shape is divided where it meets that of another shape; the pieces with material on exactly one side
form the body's outline. Arcs are kept exactly, not replaced by chords.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.models.plane_shapes import Curve, Outlined, Point, Polygon, crossings

Array = NDArray[np.float64]

_BESIDE = 1e-6
"""Distance on either side of an outline piece at which material is tested, as a share of the body's size. Finer details
are not resolved."""
_TURNS_IN = -0.2
"""Sine of the angle of a turn to the right beyond which a corner counts as re-entrant."""
_CHORDS = 65
"""Chords that replace an arc: the error of a centroid is then below 1e-5 of the arc's radius."""
_MOST_KEPT = 64
_SAME = 1e-8
"""Distance below which two corners count as one, as a share of the body's size."""


@dataclass(frozen=True)
class Loop:
    """A closed part of the outline.

    Parameters
    ----------
    curves : tuple of Curve
        Curves in order, with the body on their left: the outer loop runs anticlockwise, a hole clockwise.
    """

    curves: tuple[Curve, ...]

    @cached_property
    def chords_mm(self) -> tuple[Array, ...]:
        """Ends of the chords that replace each curve, shape (2, n) each: one chord for a straight curve."""
        return tuple(c.at(np.linspace(c.t0, c.t1, 2 if c.is_straight else _CHORDS)) for c in self.curves)

    @cached_property
    def corners_mm(self) -> Array:
        """Corners of the loop with arcs replaced by chords, shape (2, n)."""
        return np.concatenate([ends[:, :-1] for ends in self.chords_mm], axis=1)

    @cached_property
    def sides_mm(self) -> tuple[Array, ...]:
        """Points of each curve from end to end, shape (2, n) each."""
        return tuple(curve.at(np.linspace(curve.t0, curve.t1, _CHORDS)) for curve in self.curves)

    @cached_property
    def _polygon(self) -> Polygon:
        return Polygon(tuple((float(x), float(y)) for x, y in self.corners_mm.T))

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie inside the loop, with arcs replaced by their chords."""
        return self._polygon.holds(points)

    @cached_property
    def area_mm2(self) -> float:
        """Enclosed area, negative for a hole, by Green's formula (mm^2)."""
        return sum(0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) for x, y in self.chords_mm)


@dataclass(frozen=True, eq=False)
class PlanarRegion:
    """A body as a sequence of steps, each of which adds or removes a shape.

    Parameters
    ----------
    steps : tuple of (bool, Outlined)
        Steps in order, each (whether the shape is added, the shape).
    marks_mm : tuple of (float, float)
        Points that must be corners where they lie on the outline.
    """

    steps: tuple[tuple[bool, Outlined], ...]
    marks_mm: tuple[Point, ...] = ()

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie in the body."""
        inside = np.zeros(points.shape[1], dtype=bool)
        for added, shape in self.steps:
            inside = inside | shape.holds(points) if added else inside & ~shape.holds(points)
        return inside

    @cached_property
    def size_mm(self) -> float:
        """Diagonal of the bounding box of all added shapes (mm)."""
        ends = np.concatenate([c.at(np.linspace(c.t0, c.t1, 5)) for added, s in self.steps if added
                               for c in s.curves()], axis=1)  # fmt: skip
        return float(np.hypot(*(ends.max(axis=1) - ends.min(axis=1))))

    @cached_property
    def loops(self) -> tuple[Loop, ...]:
        """Closed loops of the body's outline.

        Raises
        ------
        DataError
            If two parts of the outline touch in a point, where the body is not defined.
        """
        return _loops_of(self.steps, self.marks_mm)

    def _traced(self) -> tuple[Loop, ...]:
        curves = [curve for _, shape in self.steps for curve in shape.curves()]
        pieces: list[Curve] = []
        boxes = np.array([_box_mm(curve) for curve in curves])
        apart = _BESIDE * self.size_mm
        for place, curve in enumerate(curves):
            at = [curve.t0, curve.t1]
            low, high = boxes[place, 0] - apart, boxes[place, 1] + apart
            near = np.all((boxes[:, 0] <= high) & (boxes[:, 1] >= low), axis=1)
            near[place] = False
            for other in np.flatnonzero(near).tolist():
                at += crossings(curve, curves[other])
            for mark in self.marks_mm:
                at += crossings(curve, Curve(np.array(mark), np.array([1e-12, 0.0]), None, 0.0, 1.0))
            at = sorted(at)
            pieces += [curve.part(a, b) for a, b in pairwise(at)]
        return _chained(self._on_outline(pieces), 10.0 * _SAME * self.size_mm, 2.0 * apart)

    def _on_outline(self, pieces: list[Curve]) -> list[Curve]:
        """Keep the pieces that separate the body from the void, directed so that the body lies on their left."""
        apart = _BESIDE * self.size_mm
        pieces = [p for p in pieces if np.hypot(*(p.end_mm - p.start_mm)) > 2.0 * _SAME * self.size_mm]
        middles = np.array([0.5 * (p.t0 + p.t1) for p in pieces])
        at = np.concatenate([p.at(np.array([t])) for p, t in zip(pieces, middles, strict=True)], axis=1)
        along = np.concatenate([p.direction(np.array([t])) for p, t in zip(pieces, middles, strict=True)], axis=1)
        left = np.stack([-along[1], along[0]])
        on_left, on_right = self.holds(at + apart * left), self.holds(at - apart * left)
        kept: list[Curve] = []
        seen: set[tuple[int, ...]] = set()
        for place in np.flatnonzero(on_left != on_right).tolist():
            key = tuple(np.round(at[:, place] / (10.0 * apart)).astype(int).tolist())
            if key not in seen:  # shapes that share a side have it once
                seen.add(key)
                piece = pieces[place]
                kept.append(piece if on_left[place] else piece.part(piece.t1, piece.t0))
        return kept


@lru_cache(maxsize=_MOST_KEPT)
def _loops_of(steps: tuple[tuple[bool, Outlined], ...], marks_mm: tuple[Point, ...]) -> tuple[Loop, ...]:
    """Outline of a body; cached, because every kind of model of a drawing uses it."""
    return PlanarRegion(steps, marks_mm)._traced()  # noqa: SLF001 (its own class)


def sharp_corners_mm(region: PlanarRegion) -> list[Array]:
    """Re-entrant corners without a radius, at which the stress is singular (mm)."""
    return [after.start_mm for _, after, turn in _joints(region) if turn < _TURNS_IN]


def face_ends_mm(region: PlanarRegion) -> list[Array]:
    """Points on straight sides of the outline at which faces begin and end; the stress is singular there too (mm)."""
    straight = ((after, turn) for before, after, turn in _joints(region) if before.is_straight and after.is_straight)
    return [after.start_mm for after, turn in straight if abs(turn) < _SAME]


def _joints(region: PlanarRegion) -> list[tuple[Curve, Curve, float]]:
    """Neighbouring curves of the outline, each pair with the sine of the angle of its turn to the left."""
    found = []
    for loop in region.loops:
        for before, after in zip(loop.curves, loop.curves[1:] + loop.curves[:1], strict=True):
            a, b = before.direction(np.array([before.t1]))[:, 0], after.direction(np.array([after.t0]))[:, 0]
            found.append((before, after, float(a[0] * b[1] - a[1] * b[0])))
    return found


def rounded_corner(region: PlanarRegion, near_mm: Point, radius_mm: float) -> tuple[bool, Polygon]:
    """Step that rounds a corner between two straight edges by a fillet: re-entrant corners are filled, others cut.

    Parameters
    ----------
    region : PlanarRegion
        The body.
    near_mm : (float, float)
        A point that is nearer to the corner than the radius.
    radius_mm : float
        Radius of the fillet, which touches both edges.

    Raises
    ------
    DataError
        There is no such corner, or an edge is too short for the radius.
    """
    found = [
        (float(np.hypot(*(after.start_mm - near_mm))), before, after)
        for loop in region.loops
        for before, after in zip((loop.curves[-1], *loop.curves), loop.curves, strict=False)
        if before.is_straight and after.is_straight
    ]
    apart, before, after = min(found, key=lambda each: each[0])
    a, b = before.direction(np.zeros(1))[:, 0], after.direction(np.zeros(1))[:, 0]
    x, y = after.start_mm.tolist()
    turn = float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))
    if apart > radius_mm or abs(turn) < _SAME:
        raise DataError(f"must be at a corner between two straight edges, but the nearest is at ({x:.6g}, {y:.6g}) mm.")
    back = radius_mm * float(np.tan(0.5 * abs(turn)))
    longest = min(float(np.hypot(*(c.end_mm - c.start_mm))) for c in (before, after))
    if back > longest * (1.0 + _SAME):
        raise DataError(
            f"must leave the fillet {back:.4g} mm of both edges at the corner ({x:.6g}, {y:.6g}) mm, but one is "
            f"{longest:.4g} mm long; the radius may be {radius_mm * longest / back:.4g} mm at most."
        )
    ends = [(x + s * back * d[0], y + s * back * d[1]) for s, d in ((1.0, b), (-1.0, a))]
    corners = tuple((float(p[0]), float(p[1])) for p in ((x, y), *ends))
    return turn < 0.0, Polygon(corners, (0.0, -float(np.tan(0.25 * turn)), 0.0))


def _box_mm(curve: Curve) -> tuple[Array, Array]:
    """Lower and upper corner of the bounding box of a curve; for an arc, of the whole ellipse (mm)."""
    if curve.v is None:
        points = np.stack([curve.start_mm, curve.end_mm])
    else:
        reach = np.abs(curve.u) + np.abs(curve.v)
        points = np.stack([curve.origin - reach, curve.origin + reach])
    return points.min(axis=0), points.max(axis=0)


def _chained(pieces: list[Curve], same_mm: float, unresolved_mm: float) -> tuple[Loop, ...]:
    """Join pieces to loops where one ends and the next begins.

    A piece of outline between two shapes that nearly touch may be too short to decide on which side the material lies.
    The pieces before and after this piece are then joined across a gap of at most `unresolved_mm`.
    """
    starts = np.array([p.start_mm for p in pieces]).reshape(-1, 2)
    following: dict[int, int] = {}
    for place, piece in enumerate(pieces):
        distance = np.hypot(*(starts - piece.end_mm).T)
        near = np.flatnonzero(distance < same_mm)
        if near.size == 0:
            near = np.flatnonzero(distance < unresolved_mm)
        if near.size != 1:
            x, y = piece.end_mm
            what = "ends" if near.size == 0 else "touches itself in a point"
            raise DataError(
                f"The outline must be closed and separate the body from the void everywhere, but it {what} at "
                f"({x:.6g}, {y:.6g}) mm; let the shapes overlap there, or stay apart."
            )
        following[place] = int(near[0])
    loops = []
    left = set(following)
    while left:
        first = min(left)
        order = [first]
        left.discard(first)
        while (place := following[order[-1]]) != first:
            if place not in left:
                break
            order.append(place)
            left.discard(place)
        loops.append(Loop(tuple(pieces[place] for place in order)))
    return tuple(sorted(loops, key=lambda loop: -abs(loop.area_mm2)))

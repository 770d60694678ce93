"""Plane shapes from which a body is composed: polygons and ellipses, each with its outline and its interior."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

# Curves of a plane outline: straight segments and elliptic arcs, and the points where two of them meet.

Array = NDArray[np.float64]

_WITHIN = 1e-9
"""Relative tolerance beyond a curve's ends within which a point counts as on the curve, so that curves that share a
corner meet there."""
_SAMPLES = 181
"""Samples along an arc at which crossings of two arcs are searched: crossings closer than 2 degrees are not
separated."""
_PARALLEL = 1e-12
_STRAIGHT = 1e-9
"""Bulge below which an arc counts as straight."""
_AT_ONCE = 1_000_000
"""Pairs of a side and a point that are looked at together, so that a long outline needs no more than some 10 MB."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A straight segment, p = origin + t u, or an elliptic arc, p = origin + u cos t + v sin t, for t from t0 to t1.

    Parameters
    ----------
    origin, u : ndarray of float, shape (2,)
        Start and extent of a segment; centre and first half axis of an arc. Millimetres.
    v : ndarray of float, shape (2,), or None
        Second half axis of an arc; None for a segment.
    t0, t1 : float
        Parameters at the start and the end; with t1 < t0 the curve runs backwards.
    """

    origin: Array
    u: Array
    v: Array | None
    t0: float
    t1: float

    @property
    def is_straight(self) -> bool:
        """Whether the curve is a segment."""
        return self.v is None

    @property
    def is_hollow(self) -> bool:
        """Whether the curve is an arc that runs clockwise, around the void, with the body on its left."""
        return self.v is not None and float(self.u[0] * self.v[1] - self.u[1] * self.v[0]) * (self.t1 - self.t0) < 0.0

    @property
    def start_mm(self) -> Array:
        """First point of the curve (mm)."""
        return self.at(np.array([self.t0]))[:, 0]

    @property
    def end_mm(self) -> Array:
        """Last point of the curve (mm)."""
        return self.at(np.array([self.t1]))[:, 0]

    def at(self, t: Array) -> Array:
        """Points at given parameters, shape (2, n)."""
        if self.v is None:
            return np.asarray(self.origin[:, None] + self.u[:, None] * t)
        return np.asarray(self.origin[:, None] + self.u[:, None] * np.cos(t) + self.v[:, None] * np.sin(t))

    def direction(self, t: Array) -> Array:
        """Unit tangents in the direction of travel, shape (2, n)."""
        if self.v is None:
            slope = np.repeat(self.u[:, None], len(t), axis=1)
        else:
            slope = self.v[:, None] * np.cos(t) - self.u[:, None] * np.sin(t)
        slope = slope * np.sign(self.t1 - self.t0)
        return np.asarray(slope / np.hypot(*slope))

    def curvature_radius_mm(self, t: Array) -> Array:
        """Radius of curvature (mm); infinite for a segment."""
        if self.v is None:
            return np.full(len(t), np.inf)
        first = self.v[:, None] * np.cos(t) - self.u[:, None] * np.sin(t)
        cross = abs(float(self.u[0] * self.v[1] - self.u[1] * self.v[0]))
        return np.asarray(np.sum(first**2, axis=0) ** 1.5 / cross)

    def part(self, t0: float, t1: float) -> "Curve":
        """Return the part of the curve between two other parameters."""
        return Curve(self.origin, self.u, self.v, t0, t1)

    def level(self, points: Array) -> Array:
        """Signed distance of points from the extended curve (line or whole ellipse), zero on the curve; shape (n,).

        For a line, the value is the distance in mm; for an ellipse, it is the squared relative radius minus 1.
        """
        apart = points - self.origin[:, None]
        if self.v is None:
            return np.asarray((self.u[0] * apart[1] - self.u[1] * apart[0]) / np.hypot(*self.u))
        unit = np.linalg.solve(np.array([self.u, self.v]).T, apart)
        return np.asarray(np.sum(unit**2, axis=0) - 1.0)

    def holds(self, point: Array) -> bool:
        """Whether a point on the extended curve lies between the curve's ends."""
        apart = point - self.origin
        if self.v is None:
            t = float(apart @ self.u / (self.u @ self.u))
            return min(self.t0, self.t1) - _WITHIN <= t <= max(self.t0, self.t1) + _WITHIN
        c, s = np.linalg.solve(np.array([self.u, self.v]).T, apart)
        low, high = min(self.t0, self.t1), max(self.t0, self.t1)
        turn = float(np.mod(np.arctan2(s, c) - low + _WITHIN, 2.0 * np.pi)) - _WITHIN
        return turn <= high - low + _WITHIN


def crossings(curve: Curve, other: Curve) -> list[float]:
    """Parameters of a curve, strictly between its ends, at which it meets another curve or the end of another curve."""
    found = _meetings(curve, other)
    for corner in (other.start_mm, other.end_mm):
        # Where two curves coincide, each is divided at the ends of the other.
        found += _on_curve(curve, corner)
    low, high = sorted((curve.t0, curve.t1))
    margin = _WITHIN * (high - low)
    return [t for t in found if low + margin < t < high - margin and other_holds(curve, other, t)]


def other_holds(curve: Curve, other: Curve, t: float) -> bool:
    """Whether the point at parameter t of one curve lies between the ends of another curve."""
    return other.holds(curve.at(np.array([t]))[:, 0])


def _on_curve(curve: Curve, point: Array) -> list[float]:
    size = float(np.hypot(*curve.u))
    if abs(float(curve.level(point[:, None])[0])) > 1e-9 * (size if curve.is_straight else 1.0):
        return []
    if curve.v is None:
        return [float((point - curve.origin) @ curve.u / (curve.u @ curve.u))]
    c, s = np.linalg.solve(np.array([curve.u, curve.v]).T, point - curve.origin)
    return _turned_into(curve, float(np.arctan2(s, c)))


def _turned_into(curve: Curve, angle: float) -> list[float]:
    low = min(curve.t0, curve.t1)
    return [low + float(np.mod(angle - low, 2.0 * np.pi))]


def _meetings(curve: Curve, other: Curve) -> list[float]:
    if curve.v is None and other.v is None:
        cross = curve.u[0] * other.u[1] - curve.u[1] * other.u[0]
        if abs(cross) < _PARALLEL * np.hypot(*curve.u) * np.hypot(*other.u):
            return []
        apart = other.origin - curve.origin
        return [float((apart[0] * other.u[1] - apart[1] * other.u[0]) / cross)]
    if curve.v is None:
        frame = np.array([other.u, other.v]).T
        a = np.linalg.solve(frame, curve.origin - other.origin)
        b = np.linalg.solve(frame, curve.u)
        square, half, rest = float(b @ b), float(a @ b), float(a @ a) - 1.0
        below = half**2 - square * rest
        if below < 0.0:
            return []
        return [(-half - below**0.5) / square, (-half + below**0.5) / square]
    if other.v is None:
        normal = np.array([-other.u[1], other.u[0]])
        size, middle = np.hypot(normal @ curve.u, normal @ curve.v), np.arctan2(normal @ curve.v, normal @ curve.u)
        wanted = float(normal @ (other.origin - curve.origin) / size)
        if abs(wanted) > 1.0:
            return []
        half_turn = float(np.arccos(wanted))
        return [t for sign in (-1.0, 1.0) for t in _turned_into(curve, float(middle + sign * half_turn))]
    t = np.linspace(curve.t0, curve.t1, _SAMPLES)
    level = other.level(curve.at(t))
    if np.abs(level).max() < _WITHIN:
        return []
    found = [float(t[i]) for i in np.flatnonzero(level == 0.0)]
    turns = np.flatnonzero(level[1:] * level[:-1] < 0.0).tolist()
    return found + [_meeting(curve, other, float(t[i]), float(t[i + 1])) for i in turns]


def _meeting(curve: Curve, other: Curve, a: float, b: float) -> float:
    """Parameter between two others at which a curve crosses another curve; one of both if rounding hides the change."""

    def level(t: float) -> float:
        return float(other.level(curve.at(np.array([t])))[0])

    if level(a) * level(b) > 0.0:
        return min(a, b, key=lambda t: abs(level(t)))
    return float(brentq(level, a, b))


Point = tuple[float, float]


@dataclass(frozen=True)
class Polygon:
    """A shape with straight sides, or sides that are arcs of circles.

    Parameters
    ----------
    corners_mm : tuple of (float, float)
        Corners in order, clockwise or anticlockwise.
    bulges : tuple of float
        For each corner, the tangent of a quarter of the angle of the arc from it to the next corner, positive for an
        anticlockwise arc and 0 for a straight side, as in DXF; empty if all sides are straight.
    """

    corners_mm: tuple[Point, ...]
    bulges: tuple[float, ...] = ()

    def curves(self) -> list[Curve]:
        """Sides of the polygon, as curves."""
        corners = np.array(self.corners_mm)
        bulges = self.bulges or (0.0,) * len(corners)
        sides = zip(corners, np.roll(corners, -1, axis=0), bulges, strict=True)
        return [_arc(a, b, k) if k else Curve(a, b - a, None, 0.0, 1.0) for a, b, k in sides if np.hypot(*(b - a)) > 0]

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie inside: an odd number of the polygon's sides is then to their right."""
        x, y = points
        inside = np.zeros(x.shape, dtype=bool)
        at_once = max(1, _AT_ONCE // max(1, x.size))
        for first in range(0, self._sides.shape[1], at_once):
            xa, ya, xb, yb = self._sides[:, first : first + at_once, None]
            crossed = ((ya > y) != (yb > y)) & (x < xa + (xb - xa) * (y - ya) / (yb - ya))
            inside ^= np.logical_xor.reduce(crossed, axis=0)
        for arc in self._arcs:  # the segment of the circle between the arc and its chord
            (xa, ya), (xb, yb) = arc.start_mm, arc.end_mm
            beside = (xb - xa) * (y - ya) - (yb - ya) * (x - xa)
            inside ^= (arc.level(points) < 0.0) & (beside * (arc.t1 - arc.t0) < 0.0)
        return inside

    @cached_property
    def _sides(self) -> Array:
        """Ends xa, ya, xb, yb of the sides that are not level, with arcs replaced by chords; shape (4, n)."""
        corners = np.array(self.corners_mm)
        sides = np.hstack([corners, np.roll(corners, -1, axis=0)]).T
        return sides[:, sides[1] != sides[3]]

    @cached_property
    def _arcs(self) -> tuple[Curve, ...]:
        return tuple(curve for curve in self.curves() if not curve.is_straight) if any(self.bulges) else ()


def _arc(a: Array, b: Array, bulge: float) -> Curve:
    """Arc of a circle between two points, by its bulge."""
    across = np.array([a[1] - b[1], b[0] - a[0]])
    centre = 0.5 * (a + b) + across * (1.0 - bulge**2) / (4.0 * bulge)
    radius = float(np.hypot(*(a - centre)))
    t0 = float(np.arctan2(*(a - centre)[::-1]))
    return Curve(centre, np.array([radius, 0.0]), np.array([0.0, radius]), t0, t0 + 4.0 * float(np.arctan(bulge)))


def in_arcs(at: Callable[[Array], Array], t0: float, t1: float, within_mm: float) -> list[tuple[Point, float]]:
    """Replace a curve by arcs of circles: the start of each arc and its bulge.

    Each arc goes through the curve's points at both its ends and at the middle of the parameter, so that an arc of a
    circle, given by its angle, is kept as it is.

    Parameters
    ----------
    at : callable
        Points of the curve, shape (2, n), at parameters, shape (n,).
    t0, t1 : float
        Parameters at the curve's start and end.
    within_mm : float
        Largest distance of the arcs from the curve.
    """
    points = at(np.linspace(t0, t1, 5)).T
    a, middle, b = points[::2]
    chord = b - a
    length = float(np.hypot(*chord))
    if not length and np.allclose(points, a):
        return []
    if length:
        bulge = -2.0 * float(chord[0] * (middle - a)[1] - chord[1] * (middle - a)[0]) / length**2
        bulge = 0.0 if abs(bulge) < _STRAIGHT else bulge
        arc = _arc(a, b, bulge) if bulge else Curve(a, chord, None, 0.0, 1.0)
        off = np.abs(arc.level(points[1:4].T)) * (0.5 * arc.u[0] if bulge else 1.0)
        if abs(bulge) <= 1.0 + _WITHIN and float(off.max()) <= within_mm:
            return [((float(a[0]), float(a[1])), bulge)]
    half = 0.5 * (t0 + t1)
    return in_arcs(at, t0, half, within_mm) + in_arcs(at, half, t1, within_mm)


@dataclass(frozen=True)
class Ellipse:
    """A disc or an ellipse.

    Parameters
    ----------
    centre_mm : (float, float)
        Centre of the ellipse.
    half_axes_mm : (float, float)
        Half axes, along the ellipse's axis and across it; equal for a disc.
    axis_deg : float
        Angle of the ellipse's axis from x.
    """

    centre_mm: Point
    half_axes_mm: Point
    axis_deg: float = 0.0

    def _axes(self) -> tuple[Array, Array]:
        angle = np.radians(self.axis_deg)
        along = np.array([np.cos(angle), np.sin(angle)])
        return self.half_axes_mm[0] * along, self.half_axes_mm[1] * np.array([-along[1], along[0]])

    def curves(self) -> list[Curve]:
        """Outline of the ellipse as four arcs."""
        u, v = self._axes()
        quarters = np.pi / 2.0 * np.arange(5.0)
        return [Curve(np.array(self.centre_mm), u, v, a, b) for a, b in pairwise(quarters.tolist())]

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie inside."""
        return np.asarray(self._whole.level(points) < 0.0)

    @cached_property
    def _whole(self) -> Curve:
        return Curve(np.array(self.centre_mm), *self._axes(), 0.0, 2.0 * np.pi)


Shape = Polygon | Ellipse


class Outlined(Protocol):
    """Protocol of what a region is made of: a shape with its outline."""

    def curves(self) -> list[Curve]:
        """Curves of the outline."""
        ...

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie inside."""
        ...


@dataclass(frozen=True, slots=True)
class RigidMap:
    """A motion of a drawing in its plane: an optional reflection in the line x = 0, a rotation, a translation.

    Parameters
    ----------
    turn_deg : float
        Angle of the rotation about the origin.
    by_mm : (float, float)
        The translation.
    mirrored : bool
        Whether x changes its sign before the rotation.
    """

    turn_deg: float = 0.0
    by_mm: Point = (0.0, 0.0)
    mirrored: bool = False

    def point(self, point: Point) -> Point:
        """Where a point goes."""
        c, s = (_exact(f(np.radians(self.turn_deg))) for f in (np.cos, np.sin))
        x, y = -point[0] if self.mirrored else point[0], point[1]
        return c * x - s * y + self.by_mm[0], s * x + c * y + self.by_mm[1]

    def angle_deg(self, angle_deg: float) -> float:
        """Direction into which an axis with a direction turns."""
        return self.turn_deg + (180.0 - angle_deg if self.mirrored else angle_deg)

    def shape(self, shape: Shape) -> Shape:
        """Where a shape goes."""
        if isinstance(shape, Ellipse):
            return Ellipse(self.point(shape.centre_mm), shape.half_axes_mm, self.angle_deg(shape.axis_deg))
        bulges = tuple(-bulge for bulge in shape.bulges) if self.mirrored else shape.bulges
        return Polygon(tuple(map(self.point, shape.corners_mm)), bulges)


def _exact(share: float) -> float:
    """Sine or cosine of a quarter turn without its rounding error, so that edges along x and y stay so."""
    return float(np.round(share)) if abs(share - np.round(share)) < _PARALLEL else float(share)


def crosses_itself(polygon: Polygon) -> bool:
    """Whether two non-adjacent sides of a polygon meet."""
    sides = polygon.curves()
    count = len(sides)
    return any(
        crossings(sides[i], sides[j])
        for i in range(count)
        for j in range(i + 2, count)
        if not (i == 0 and j == count - 1)
    )


def bar(x0: float, y0: float, x1: float, y1: float, width_mm: float) -> Polygon:
    """A straight bar whose axis joins two points."""
    length = float(np.hypot(x1 - x0, y1 - y0))
    nx, ny = -(y1 - y0) / length * width_mm / 2.0, (x1 - x0) / length * width_mm / 2.0
    return Polygon(((x0 - nx, y0 - ny), (x1 - nx, y1 - ny), (x1 + nx, y1 + ny), (x0 + nx, y0 + ny)))


def box(x0: float, x1: float, y0: float, y1: float) -> Polygon:
    """An upright rectangle."""
    return Polygon(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))

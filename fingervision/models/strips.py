"""Strips and notches that bodies and cuts leave in a drawing, and accidental necks: flexures that no section names.

Wire-cut stages are drawn as a block with slots: the strips between the slots are leaf flexures, although no section
names them. A strip that is a quarter as thick as the material at both its ends is 64 times as flexible in bending per
length, and carries the motion. So does a neck between two hollow arcs, or between such an arc and a straight side, that
opens to thrice its thickness: an outline from a CAD program has its notch hinges so.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import PointMm
from fingervision.models.flexure import Flexure, FlexureKind
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Curve

Array = NDArray[np.float64]

_THINNER = 4.0
"""Least thickness of the material at both ends of a strip, in thicknesses of the strip."""
_SLENDER = 2.0
"""Least length of a strip in thicknesses, with its fillets: what is shorter does not bend as a beam."""
_PARALLEL = 1e-6
"""Largest sine of the angle between the sides of a strip."""
_SAMPLES = 33
_SAME = 1e-3
"""Distance along a side, as a share of its length, below which its end is the end of the strip."""
_TANGENT = 1e-3
"""Largest sine of the angle at which a fillet's arc meets the strip's side."""
_BEYOND = 1.0
"""Distance beyond a strip's end, in thicknesses, at which the thickness of the material there is measured."""
_NECK = 1.5
"""Thickness, in that of the thinnest named flexure, below which a neck that no flexure names is reported: by the cube,
it is at least a third as stiff in bending as that flexure."""
_MAX_FILLET = 4.0
"""Largest radius at a strip's end, in thicknesses, that counts as its fillet."""
_OPENS = 3.0
"""Least height of a notch at both its ends, in thicknesses of its neck: that of a notch with t / R = 1, the largest in
the tables of hinges. It is 27 times as stiff in bending there."""
_ON_FORM = 0.02
"""Largest distance of a notch's faces from circles or ellipses, in thicknesses: CAD programs and the reading of
outlines replace ellipses by arcs within 1 micrometre."""
_ALIKE = 0.01
"""Relative difference below which the half axes of the two faces of a notch count as equal."""
_SMOOTH = 0.05
"""Largest sine of the angle between two neighbouring arcs of one face: arcs that replace an ellipse meet at less."""
_ACROSS_AXIS = 1e-2
"""Largest sine of the angle between the axis of an ellipse and the line across the neck, whose thickness is then right
within the square of it."""
_ROUND = 1e-4
"""Largest distance of points from their circle, in radii."""
_AT_NECK = 0.05
"""Largest distance between points of a face that goes through the neck, in half lengths of the notch."""


def strips_of(region: PlanarRegion, named: Sequence[Flexure]) -> tuple[Flexure, ...]:
    """Find the strips and notches that are much thinner than what they join, and that no flexure of the drawing names.

    Parameters
    ----------
    region : PlanarRegion
        The body.
    named : sequence of Flexure
        Flexures of the drawing.

    Returns
    -------
    tuple of Flexure
        Flexures that are `found`: of the kind `strip`, called strip 1, strip 2, ..., and of the kinds `circular` and
        `elliptic`, called notch 1, notch 2, ...
    """
    sides = [(loop.curves, place) for loop in region.loops for place, c in enumerate(loop.curves) if c.is_straight]
    hollow = [face for loop in region.loops for face in _hollow_faces(loop.curves)]
    straight = [_straight_face(curves[place]) for curves, place in sides]
    candidates = [_strip(region, *pair) for pair in combinations(sides, 2)]
    candidates += [_notch(region, *pair) for pair in (*combinations(hollow, 2), *product(hollow, straight))]
    found: list[Flexure] = []
    for flexure in candidates:
        if flexure is not None and not any(_lies_on(flexure, other) for other in (*named, *found)):
            number = 1 + sum(other.is_notch == flexure.is_notch for other in found)
            found.append(replace(flexure, name=f"{'notch' if flexure.is_notch else 'strip'} {number}"))
    return tuple(found)


def _lies_on(strip: Flexure, other: Flexure) -> bool:
    """Whether a strip is part of another flexure: its middle lies between that flexure's ends and surfaces, or near."""
    apart = np.subtract(strip.at_mm, other.at_mm)
    if np.hypot(*apart) < 0.5 * (strip.thickness_mm + other.thickness_mm):
        return True
    angle = np.radians(other.axis_deg)
    along, across = apart @ [np.cos(angle), np.sin(angle)], apart @ [-np.sin(angle), np.cos(angle)]
    return bool(abs(along) <= other.half_length_mm and abs(across) <= 0.5 * other.thickness_mm + other.depth_mm)


def _strip(
    region: PlanarRegion, first: tuple[tuple[Curve, ...], int], second: tuple[tuple[Curve, ...], int]
) -> Flexure | None:
    """The strip between two straight parts of the outline, if they are the sides of one."""
    a, b = first[0][first[1]], second[0][second[1]]
    way = a.direction(np.array([a.t0]))[:, 0]
    back = b.direction(np.array([b.t0]))[:, 0]
    normal = np.array([-way[1], way[0]])
    thickness = float(normal @ (b.start_mm - a.start_mm))
    if way @ back > 0.0 or abs(way[0] * back[1] - way[1] * back[0]) > _PARALLEL or thickness <= 0.0:
        return None
    spans = [sorted(float(way @ point) for point in (c.start_mm, c.end_mm)) for c in (a, b)]
    low, high = max(span[0] for span in spans), min(span[1] for span in spans)
    if high <= low:
        return None
    origin = a.start_mm - (way @ a.start_mm) * way + 0.5 * thickness * normal
    radii = [[_fillet_mm(*side, origin + end * way) for side in (first, second)] for end in (low, high)]
    fillet = min(map(min, radii)) if max(map(min, radii)) <= _MAX_FILLET * thickness else 0.0
    half = 0.5 * (high - low) + fillet
    if 2.0 * half < _SLENDER * thickness:
        return None
    along = np.linspace(low + 1e-3 * thickness, high - 1e-3 * thickness, _SAMPLES)
    inside = [origin[:, None] + np.outer(way, along) + y * thickness * normal[:, None] for y in (-0.49, 0.0, 0.49)]
    if not region.holds(np.concatenate(inside, axis=1)).all():
        return None
    for end, sign, ends in ((low, -1.0, radii[0]), (high, 1.0, radii[1])):
        reach = max((radius for radius in ends if np.isfinite(radius)), default=0.0)
        at = origin + (end + sign * (reach + _BEYOND * thickness)) * way
        if _width_mm(region, at, normal, thickness) < _THINNER * thickness:
            return None
    x, y = origin + 0.5 * (low + high) * way
    axis_deg = float(np.degrees(np.arctan2(way[1], way[0])))
    return Flexure("", "strip", (float(x), float(y)), axis_deg, thickness, half, fillet, fillet, found=True)


def _fillet_mm(curves: tuple[Curve, ...], place: int, end_mm: Array) -> float:
    """Radius of the arc that continues a side at one end of a strip: 0 at a sharp corner, infinite where it goes on."""
    side = curves[place]
    before, after = curves[place - 1], curves[(place + 1) % len(curves)]
    starts = np.hypot(*(side.start_mm - end_mm)) < np.hypot(*(side.end_mm - end_mm))
    other, own, theirs = (before, side.t0, before.t1) if starts else (after, side.t1, after.t0)
    way = side.direction(np.array([own]))[:, 0]
    if abs(way @ (side.at(np.array([own]))[:, 0] - end_mm)) > _SAME * np.hypot(*(side.end_mm - side.start_mm)):
        return np.inf
    at = np.array([theirs])
    next_way = other.direction(at)[:, 0]
    if abs(way[0] * next_way[1] - way[1] * next_way[0]) > _TANGENT:
        return 0.0
    return float(other.curvature_radius_mm(at)[0])


def _width_mm(region: PlanarRegion, at: Array, normal: Array, thickness: float) -> float:
    """Extent of the material across a strip's axis at a point beyond its end, up to some thicknesses to either side."""
    steps = np.linspace(0.0, _THINNER * thickness, 8 * _SAMPLES)
    width = 0.0
    for sign in (-1.0, 1.0):
        held = region.holds(at[:, None] + sign * np.outer(normal, steps))
        width += float(steps[-1] if held.all() else steps[max(int(np.argmin(held)) - 1, 0)])
    return width


@dataclass(frozen=True, slots=True, eq=False)
class _Face:
    """A side of a neck: one straight side, or hollow arcs that follow each other without a corner and form an ellipse.

    Parameters
    ----------
    points_mm : ndarray of float, shape (2, n)
        Points of the face.
    centre_mm : ndarray of float, shape (2,)
        Centre of the ellipse; a point of a straight side.
    ways : ndarray of float, shape (2, 2)
        Directions of the axes of the ellipse; for a straight side, of the side and of its normal.
    halves_mm : ndarray of float, shape (2,)
        Half axes; infinite and zero for a straight side.
    """

    points_mm: Array
    centre_mm: Array
    ways: Array
    halves_mm: Array

    @property
    def is_straight(self) -> bool:
        """Whether the face is a straight side."""
        return not np.isfinite(self.halves_mm[0])

    def halves_at(self, across: Array) -> tuple[float, float] | None:
        """Half axes along a neck and across it, for a unit vector across it; None if an axis is askew to it."""
        along, beside = self.halves_mm.tolist()
        if along == beside:
            return along, beside
        own = int(np.argmax(np.abs(self.ways @ across)))
        is_askew = abs(float(self.ways[1 - own] @ across)) > _ACROSS_AXIS
        return None if is_askew else (float(self.halves_mm[1 - own]), float(self.halves_mm[own]))


def _straight_face(curve: Curve) -> _Face:
    way = curve.direction(np.zeros(1))[:, 0]
    points = curve.at(np.linspace(curve.t0, curve.t1, _SAMPLES))
    return _Face(points, curve.start_mm, np.array([way, [-way[1], way[0]]]), np.array([np.inf, 0.0]))


def _hollow_faces(curves: tuple[Curve, ...]) -> list[_Face]:
    """Runs of arcs of a loop that bend around the void; a closed hole is none, and neither are arcs of another form."""

    def goes_on(place: int) -> bool:
        """Whether a hollow arc continues the one before it."""
        before, after = curves[place - 1], curves[place]
        if not (before.is_hollow and after.is_hollow):
            return False
        a, b = before.direction(np.array([before.t1]))[:, 0], after.direction(np.array([after.t0]))[:, 0]
        return bool(a @ b > 0.0 and abs(a[0] * b[1] - a[1] * b[0]) < _SMOOTH)

    runs: list[list[Array]] = []
    first = next((place for place in range(len(curves)) if not goes_on(place)), None)
    for place in () if first is None else (*range(first, len(curves)), *range(first)):
        curve = curves[place]
        if curve.is_hollow:
            runs += [] if goes_on(place) else [[]]
            runs[-1].append(curve.at(np.linspace(curve.t0, curve.t1, 4 * _SAMPLES)))
    return [face for run in runs if (face := _ellipse_through(np.concatenate(run, axis=1))) is not None]


def _ellipse_through(points_mm: Array) -> _Face | None:
    """Fit a circle, or else a conic, by least squares of its equation; None if the conic is no ellipse."""
    middle = points_mm.mean(axis=1)
    size = float(np.hypot(*(points_mm - middle[:, None])).max())
    x, y = (points_mm - middle[:, None]) / size
    cx, cy, rest = np.linalg.lstsq(np.stack([2.0 * x, 2.0 * y, np.ones_like(x)]).T, x**2 + y**2, rcond=None)[0]
    radius = float(np.sqrt(rest + cx**2 + cy**2))
    if np.abs(np.hypot(x - cx, y - cy) - radius).max() < _ROUND * radius:
        return _Face(points_mm, middle + size * np.array([cx, cy]), np.eye(2), np.full(2, size * radius))
    terms = np.stack([x**2, 2.0 * x * y, y**2, 2.0 * x, 2.0 * y, np.ones_like(x)])
    a, b, c, d, e, f = np.linalg.svd(terms.T, full_matrices=False)[2][-1]
    square = np.array([[a, b], [b, c]])
    if a * c - b**2 <= 0.0:
        return None
    centre = -np.linalg.solve(square, [d, e])
    values, ways = np.linalg.eigh(square / (centre @ square @ centre - f))
    return _Face(points_mm, middle + size * centre, ways.T, size / np.sqrt(values))


def _notch(region: PlanarRegion, first: _Face, second: _Face) -> Flexure | None:
    """The notch between a hollow face and another hollow or a straight one, if they are the sides of a neck."""
    apart = second.centre_mm - first.centre_mm
    across = second.ways[1] * float(second.ways[1] @ apart) if second.is_straight else apart
    if not np.hypot(*across) > 0.0:
        return None
    across = across / np.hypot(*across)
    along = np.array([across[1], -across[0]])
    halves = [face.halves_at(across) for face in (first, second)]
    if halves[0] is None or halves[1] is None:
        return None
    (a, c), (a_other, c_other) = halves[0], halves[1]
    thickness = float(across @ apart) - c - c_other
    is_alike = abs(a_other - a) < _ALIKE * a and abs(c_other - c) < _ALIKE * c
    if thickness <= 0.0 or not (is_alike or second.is_straight):
        return None
    origin = first.centre_mm + (c + 0.5 * thickness) * across
    opened, off = np.full(2, thickness), []
    for side, face, length, depth in ((-1.0, first, a, c), (1.0, second, a_other, c_other)):
        x, y = along @ (face.points_mm - origin[:, None]), side * across @ (face.points_mm - origin[:, None])
        x, rise = (part[y < depth + 0.5 * thickness + _ON_FORM * thickness] for part in (x, y - 0.5 * thickness))
        beyond = [rise[x * end > 0.0] for end in (-1.0, 1.0)]
        if not (beyond[0].size and beyond[1].size) or np.abs(x).min() > _AT_NECK * a:
            return None
        opened += [part.max() for part in beyond]
        bends = rise < thickness
        error = rise - depth * (1.0 - np.sqrt(1.0 - np.minimum(np.abs(x) / length, 1.0) ** 2))
        if not bends.any() or np.abs(error[bends]).max() > _ON_FORM * thickness:
            return None
        off.append(float(error[np.argmin(np.abs(x))]))
    if opened.min() < _OPENS * thickness:
        return None
    thickness += sum(off)
    x, y = origin + 0.5 * (off[1] - off[0]) * across
    inside = np.array([x, y])[:, None] + np.outer(across, 0.49 * thickness * np.linspace(-1.0, 1.0, _SAMPLES))
    if not region.holds(inside).all():
        return None
    a, c = (a, 0.5 * c) if second.is_straight else (0.5 * (a + a_other), 0.5 * (c + c_other))
    kind: FlexureKind = "circular" if abs(a - c) < _ALIKE * a else "elliptic"
    if kind == "circular":
        a = c = 0.5 * (a + c)
    axis_deg = float(np.degrees(np.arctan2(along[1], along[0])))
    lean = -1.0 if second.is_straight else 0.0
    return Flexure("", kind, (float(x), float(y)), axis_deg, thickness, a, c, lean=lean, found=True)


def necks_of(region: PlanarRegion, flexures: Sequence[Flexure]) -> list[tuple[PointMm, float]]:
    """Find places at which the body is about as thin as its thinnest flexure, although no flexure is there.

    Returns
    -------
    list of ((float, float), float)
        Middle of each neck and its thickness (mm), the thinnest first; without flexures, there is nothing to compare.
    """
    if not flexures:
        return []
    limit = _NECK * min(flexure.thickness_mm for flexure in flexures)
    found: list[tuple[PointMm, float]] = []
    curves = [curve for loop in region.loops for curve in loop.curves]
    points = [curve.at(np.linspace(curve.t0, curve.t1, _SAMPLES)) for curve in curves]
    ways = [curve.direction(np.linspace(curve.t0, curve.t1, _SAMPLES)) for curve in curves]
    starts = np.cumsum([0, *(len(loop.curves) for loop in region.loops)])
    after = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in pairwise(starts.tolist())])
    before = np.argsort(after)
    # Of both ends of every curve: the end, and the points of the outline before and after it.
    ends = [
        np.stack([[points[before[i]][:, -2], p[:, 0], p[:, 1]], [p[:, -2], p[:, -1], points[after[i]][:, 1]]])
        for i, p in enumerate(points)
    ]
    for i, j in combinations(range(len(curves)), 2):
        apart = points[j][:, None, :] - points[i][:, :, None]
        distance = np.hypot(*apart)
        # Outlines of a neck run in opposite directions, with the body to the left of both.
        left = -ways[i][1][:, None] * apart[0] + ways[i][0][:, None] * apart[1]
        facing = (left > 0.9 * distance) & (np.einsum("an,am->nm", ways[i], ways[j]) < -0.9)
        distance = np.where(facing, distance, np.inf)
        a, b = np.unravel_index(int(np.argmin(distance)), distance.shape)
        if not distance[a, b] < limit or _is_tip(ends[i], ends[j], limit):
            continue
        x, y = 0.5 * (points[i][:, a] + points[j][:, b])
        here = Flexure("", "strip", (float(x), float(y)), 0.0, float(distance[a, b]), 0.0)
        known = [*flexures, *(Flexure("", "strip", at, 0.0, thickness, 0.0) for at, thickness in found)]
        if region.holds(np.array([[x], [y]]))[0] and not any(_lies_on(here, flexure) for flexure in known):
            found.append((here.at_mm, here.thickness_mm))
    return sorted(found, key=lambda neck: neck[1])


def _is_tip(ends: Array, others: Array, near_mm: float) -> bool:
    """Whether two curves come near each other at their ends, where the body becomes thin without a neck.

    At a neck, the outlines part on both sides of the ends: there two arcs may end that go on as arcs.
    """
    apart = np.hypot(*(ends[:, None, 1] - others[None, :, 1]).transpose(2, 0, 1))
    if not apart.min() < near_mm:
        return False
    end, other = (each[place] for each, place in zip((ends, others), np.divmod(int(np.argmin(apart)), 2), strict=True))
    return bool(np.hypot(*(end - other[::-1]).T)[[0, 2]].min() <= apart.min() * (1.0 + _SAME**2))

"""Thin strips that bodies and cuts leave in a drawing, and accidental necks: flexures that the drawing does not name.

Wire-cut stages are drawn as a block with slots: the strips between the slots are leaf flexures, although no section
names them. A strip that is a quarter as thick as the material at both its ends is 64 times as flexible in bending per
length, and carries the motion.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import PointMm
from fingervision.models.flexure import Flexure
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Curve

Array = NDArray[np.float64]

_THINNER = 4.0
"""Least thickness of the material at both ends of a strip, in thicknesses of the strip."""
_SLENDER = 2.0
"""Least length of a strip in thicknesses: what is shorter does not bend as a beam."""
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


def strips_of(region: PlanarRegion, named: Sequence[Flexure]) -> tuple[Flexure, ...]:
    """Find the straight strips that are much thinner than what they join, and that no flexure of the drawing names.

    Parameters
    ----------
    region : PlanarRegion
        The body.
    named : sequence of Flexure
        Flexures of the drawing.

    Returns
    -------
    tuple of Flexure
        Flexures of the kind `strip`, called strip 1, strip 2, ...
    """
    sides = [(loop.curves, place) for loop in region.loops for place, c in enumerate(loop.curves) if c.is_straight]
    found: list[Flexure] = []
    for first, second in combinations(sides, 2):
        strip = _strip(region, first, second)
        if strip is not None and not any(_lies_on(strip, flexure) for flexure in (*named, *found)):
            found.append(strip)
    return tuple(replace(strip, name=f"strip {n}") for n, strip in enumerate(found, 1))


def _lies_on(strip: Flexure, other: Flexure) -> bool:
    """Whether a strip is part of another flexure: its middle lies between that flexure's ends and surfaces."""
    apart = np.subtract(strip.at_mm, other.at_mm)
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
    if high - low < _SLENDER * thickness:
        return None
    origin = a.start_mm - (way @ a.start_mm) * way + 0.5 * thickness * normal
    along = np.linspace(low + 1e-3 * thickness, high - 1e-3 * thickness, _SAMPLES)
    inside = [origin[:, None] + np.outer(way, along) + y * thickness * normal[:, None] for y in (-0.49, 0.0, 0.49)]
    if not region.holds(np.concatenate(inside, axis=1)).all():
        return None
    fillets = []
    for end, sign in ((low, -1.0), (high, 1.0)):
        radii = [_fillet_mm(*side, origin + end * way) for side in (first, second)]
        fillets.append(min(radii))
        reach = max((radius for radius in radii if np.isfinite(radius)), default=0.0)
        at = origin + (end + sign * (reach + _BEYOND * thickness)) * way
        if _width_mm(region, at, normal, thickness) < _THINNER * thickness:
            return None
    fillet = min(fillets) if max(fillets) <= _MAX_FILLET * thickness else 0.0
    x, y = origin + 0.5 * (low + high) * way
    axis_deg = float(np.degrees(np.arctan2(way[1], way[0])))
    half = 0.5 * (high - low) + fillet
    return Flexure("", "strip", (float(x), float(y)), axis_deg, thickness, half, fillet, fillet)


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
    for i, j in combinations(range(len(curves)), 2):
        apart = points[j][:, None, :] - points[i][:, :, None]
        distance = np.hypot(*apart)
        # Outlines of a neck run in opposite directions, with the body to the left of both.
        left = -ways[i][1][:, None] * apart[0] + ways[i][0][:, None] * apart[1]
        facing = (left > 0.9 * distance) & (np.einsum("an,am->nm", ways[i], ways[j]) < -0.9)
        distance = np.where(facing, distance, np.inf)
        a, b = np.unravel_index(int(np.argmin(distance)), distance.shape)
        # Where two curves meet in a sharp tip, the body becomes thin without a neck.
        meet = min(np.hypot(*(p - q)) for p in points[i][:, [0, -1]].T for q in points[j][:, [0, -1]].T)
        if not distance[a, b] < limit or meet < limit:
            continue
        x, y = 0.5 * (points[i][:, a] + points[j][:, b])
        here = Flexure("", "strip", (float(x), float(y)), 0.0, float(distance[a, b]), 0.0)
        if region.holds(np.array([[x], [y]]))[0] and not any(_lies_on(here, flexure) for flexure in flexures):
            found.append((here.at_mm, here.thickness_mm))
    return sorted(found, key=lambda neck: neck[1])

"""The shape of a finger's end: three straight sides joined by two round corners, and where a point lies on it."""

from math import atan2, erfc, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Order of the parameters. A line is across = c + m (along - y0), or along = c + m (across - x0) for the top.
INNER_C, OUTER_C, INNER_M, OUTER_M, INNER_R, OUTER_R, TOP_C, TOP_M = range(8)
PARAMETERS = 8
# Fillets below so many sigma are sharp corners in the picture, which say nothing within so many sigma.
SHARP_IN_BLURS, SHARP_REACH = 1.5, 2.0
# Beyond so many sigma of a fillet's end nothing of its curvature is felt.
FELT_SIGMAS = 6.0
# A line that runs along an edge still sees it at this slant.
LEAST_SLANT = 0.3
# A top that is flatter than this crosses no height.
LEAST_STEEPNESS = 1e-3


class Corner(NamedTuple):
    """One flank, the top, and the fillet between them: outward unit normals n, offsets n . q, centre and radius."""

    flank_x: float
    flank_y: float
    flank_k: float
    top_x: float
    top_y: float
    top_k: float
    centre_x: float
    centre_y: float
    radius: float
    determinant: float


@compiled
def corner(p: Floats, origin: Floats, is_outer: int) -> Corner:
    """The inner (0) or the outer (1) corner of a shape."""
    slope, radius = p[INNER_M + is_outer], p[INNER_R + is_outer]
    flank_x = (1.0 - 2.0 * is_outer) / sqrt(1.0 + slope * slope)
    flank_y = -slope * flank_x
    top_y = -1.0 / sqrt(1.0 + p[TOP_M] * p[TOP_M])
    top_x = -p[TOP_M] * top_y
    flank_k = flank_x * p[INNER_C + is_outer] + flank_y * origin[1]
    top_k = top_x * origin[0] + top_y * p[TOP_C]
    determinant = flank_x * top_y - flank_y * top_x
    centre_x = ((flank_k - radius) * top_y - (top_k - radius) * flank_y) / determinant
    centre_y = (flank_x * (top_k - radius) - top_x * (flank_k - radius)) / determinant
    return Corner(flank_x, flank_y, flank_k, top_x, top_y, top_k, centre_x, centre_y, radius, determinant)


class Place(NamedTuple):
    """Where a point lies on a corner.

    `alpha` and `beta` are its coordinates, from the centre of the fillet, in the basis of the flank's and the top's
    normal; `to_flank` and `to_top` are what a shift of those sides moves its distance from the outline by.
    """

    distance: float
    alpha: float
    beta: float
    is_on_fillet: bool
    to_flank: float
    to_top: float


@compiled
def _place(c: Corner, x: float, y: float) -> Place:
    """Signed normal distance of a point from the outline, and which side it belongs to."""
    ux, uy = x - c.centre_x, y - c.centre_y
    alpha = (ux * c.top_y - uy * c.top_x) / c.determinant
    beta = (c.flank_x * uy - c.flank_y * ux) / c.determinant
    if alpha > 0.0 and beta > 0.0:
        length = max(sqrt(ux * ux + uy * uy), 1e-6)
        return Place(length - c.radius, alpha, beta, True, alpha / length, beta / length)
    if beta <= 0.0 and alpha > beta:
        return Place(c.flank_x * x + c.flank_y * y - c.flank_k, alpha, beta, False, 1.0, 0.0)
    return Place(c.top_x * x + c.top_y * y - c.top_k, alpha, beta, False, 0.0, 1.0)


@compiled
def _half_level(c: Corner, at: Place, ux: float, uy: float, blur: float) -> float:
    """How far the half-level lies inside the outline at a point, (ux, uy) from the fillet's centre.

    The shift is sigma^2 kappa / 2 on a fillet and fades out beyond its ends: the mean of the heat kernels from 0 to
    sigma^2 / 2 acts like one of variance sigma^2 / 2.
    """
    share = 1.0
    for nx, ny, past_end in ((c.flank_x, c.flank_y, at.beta), (c.top_x, c.top_y, at.alpha)):
        along = abs(ux * ny - uy * nx)
        inside = (c.radius * atan2(along, ux * nx + uy * ny) if past_end > 0.0 else -along) / (blur * sqrt(0.5))
        if inside < -FELT_SIGMAS:
            return 0.0
        share *= 0.5 * erfc(-inside * sqrt(0.5))
    return 0.5 * blur * blur / max(c.radius, blur) * share


@compiled
def compared(
    p: Floats, origin: Floats, x: Floats, y: Floats, u: Floats, is_row: Flags, is_outer: Flags, blur: Floats
) -> tuple[Floats, Floats, Flags]:
    """Compare the points of a half-level outline with a shape.

    A fillet's centre follows the two sides that it touches: the distance of a point on it changes as if both sides,
    seen from the centre, moved along their normals.

    Returns
    -------
    distance : ndarray of float, shape (n,)
        From the shape's own half-level along its normal, in units of its uncertainty.
    jacobian : ndarray of float, shape (n, 8)
        Change of the distance with every parameter.
    counts : ndarray of bool, shape (n,)
        False where a blurred-out corner leaves a point no say.
    """
    n = x.size
    distance, jacobian = np.empty(n), np.zeros((n, PARAMETERS))
    counts = np.ones(n, dtype=np.bool_)
    corners = (corner(p, origin, 0), corner(p, origin, 1))
    for i in range(n):
        outer = 1 if is_outer[i] else 0
        c = corners[outer]
        at = _place(c, x[i], y[i])
        ux, uy = x[i] - c.centre_x, y[i] - c.centre_y
        # A point that is found along a line moves along the normal by its slant only.
        flank, top = (c.flank_x, c.top_x) if is_row[i] else (c.flank_y, c.top_y)
        scale = 1.0 / (u[i] * max(abs(at.to_flank * flank + at.to_top * top), LEAST_SLANT))
        distance[i] = (at.distance + _half_level(c, at, ux, uy, blur[i])) * scale
        reach = -(SHARP_REACH * blur[i] + c.radius)
        counts[i] = c.radius >= SHARP_IN_BLURS * blur[i] or at.alpha <= reach or at.beta <= reach
        by_flank, by_top = -at.to_flank * c.flank_x * scale, -at.to_top * c.top_y * scale
        qx, qy, turning = x[i], y[i], 0.0
        if at.is_on_fillet:
            # A side that turns takes the centre of its fillet along, which lies a radius inside it.
            qx, qy, turning = c.centre_x, c.centre_y, c.radius
            jacobian[i, INNER_R + outer] = (at.to_flank + at.to_top - 1.0) * scale
        jacobian[i, INNER_C + outer] = by_flank
        jacobian[i, INNER_M + outer] = by_flank * (qy - origin[1] + turning * c.flank_y)
        jacobian[i, TOP_C] = by_top
        jacobian[i, TOP_M] = by_top * (qx - origin[0] + turning * c.top_x)
    return distance, jacobian, counts


@compiled
def on_flanks(p: Floats, origin: Floats, x: Floats, y: Floats) -> Flags:
    """Whether each point lies on the straight part of a flank."""
    corners = (corner(p, origin, 0), corner(p, origin, 1))
    middle = 0.5 * (corners[0].centre_x + corners[1].centre_x)
    is_on = np.zeros(x.size, dtype=np.bool_)
    for i in range(x.size):
        at = _place(corners[1 if x[i] <= middle else 0], x[i], y[i])
        is_on[i] = not at.is_on_fillet and at.to_flank == 1.0
    return is_on


@compiled
def corner_tops(p: Floats, origin: Floats) -> tuple[float, float, float, float]:
    """Where the inner and then the outer fillet is outermost along the axis: x, y, x, y."""
    inner, outer = corner(p, origin, 0), corner(p, origin, 1)
    return inner.centre_x, inner.centre_y - inner.radius, outer.centre_x, outer.centre_y - outer.radius


@compiled
def inner_edge(p: Floats, origin: Floats, y: float) -> tuple[float, float]:
    """Where the inner side of the outline crosses a height, and its change there per pixel towards the root."""
    c = corner(p, origin, 0)
    if y >= c.centre_y + c.radius * c.flank_y:
        return p[INNER_C] + p[INNER_M] * (y - origin[1]), p[INNER_M]
    if y <= c.centre_y + c.radius * c.top_y:
        steepness = p[TOP_M] if abs(p[TOP_M]) >= LEAST_STEEPNESS else LEAST_STEEPNESS
        return origin[0] + (y - p[TOP_C]) / steepness, 1.0 / steepness
    inside = min(max(y - c.centre_y, -0.999 * c.radius), 0.999 * c.radius)
    half_width = sqrt(max(c.radius * c.radius - inside * inside, 1e-12))
    return c.centre_x + half_width, -inside / half_width

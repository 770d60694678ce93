"""Shape of a finger's end: three straight sides and two round corners, distances of points, tip and inner edge."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Order of the parameters. A line is across = c + m (along - y0), or along = c + m (across - x0) for the top.
INNER_C, OUTER_C, INNER_M, OUTER_M, INNER_R, OUTER_R, TOP_C, TOP_M = range(8)
PARAMETERS = 8
# Radius (in sigma) below which a fillet looks like a sharp corner, and distance from this corner (in sigma) within
# which points carry no information.
SHARP_IN_BLURS, SHARP_REACH = 1.5, 2.0
# Distance beyond the end of a fillet (in sigma) from which its curvature has no effect.
FELT_SIGMAS = 6.0
# Distance inside the end of a fillet (in sigma) from which its curvature has its full effect.
WHOLLY_FELT_SIGMAS = 9.0
# Least cosine between a line of pixels and the edge's normal that is used.
LEAST_SLANT = 0.3
# Least slope of a top whose crossing with a height is computed.
LEAST_STEEPNESS = 1e-3

_compared = loop("finger_shape_compared")
_on_flanks = loop("finger_shape_on_flanks")
_seen = loop("finger_shape_seen")
_corner_tops = loop("finger_shape_corner_tops")
_inner_edge = loop("finger_shape_inner_edge")


def compared(
    p: Floats, origin: Floats, x: Floats, y: Floats, u: Floats, is_row: Flags, is_outer: Flags, blur: Floats
) -> tuple[Floats, Floats, Flags]:
    """Compare points of a half-level outline with the shape of a finger's end.

    Returns
    -------
    distance : ndarray of float, shape (n,)
        Distance of each point from the shape's own half-level contour along the normal, in units of the point's
        uncertainty.
    jacobian : ndarray of float, shape (n, 8)
        Derivatives of the distance by the parameters.
    counts : ndarray of bool, shape (n,)
        False for a point near a corner so blurred that the point carries no information.
    """
    distance, jacobian = np.empty(x.size), np.empty((x.size, PARAMETERS))
    counts = np.empty(x.size, dtype=np.bool_)
    _compared(p, origin, x, y, u, is_row, is_outer, blur, distance, jacobian, counts)
    return distance, jacobian, counts


def on_flanks(p: Floats, origin: Floats, x: Floats, y: Floats) -> Flags:
    """Whether each point of the outline lies on the straight part of a flank."""
    is_on = np.empty(x.size, dtype=np.bool_)
    _on_flanks(p, origin, x, y, is_on)
    return is_on


def seen(p: Floats, origin: Floats, x: Floats, y: Floats, is_row: Flags) -> tuple[Flags, Floats]:
    """Corner of each point of the outline, and the cosine between its line of pixels and the outline's normal.

    Returns
    -------
    is_outer : ndarray of bool, shape (n,)
        Whether the point belongs to the outer half of the finger (its outer flank, corner and half of the top).
    slant : ndarray of float, shape (n,)
        A deviation d along the normal is d / slant along the line of pixels; at least `LEAST_SLANT`.
    """
    is_outer, slant = np.empty(x.size, dtype=np.bool_), np.empty(x.size)
    _seen(p, origin, x, y, is_row, is_outer, slant)
    return is_outer, slant


def corner_tops(p: Floats, origin: Floats) -> tuple[float, float, float, float]:
    """Outermost points (along the axis) of the inner and the outer fillet, as x, y, x, y."""
    inner_x, inner_y, outer_x, outer_y = _corner_tops(p, origin)
    return inner_x, inner_y, outer_x, outer_y


def inner_edge(p: Floats, origin: Floats, y: float) -> tuple[float, float]:
    """Position of the outline's inner side at a height, and its slope there per pixel towards the root."""
    edge, slope = _inner_edge(p, origin, y)
    return edge, slope

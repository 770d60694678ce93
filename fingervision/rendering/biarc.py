"""Approximation of a smooth curve by circular arcs: two between each pair of points, with a common tangent.

Every rendered outline thus consists of lines and arcs, even an ellipse or the image of a line through a lens, so that
parallel curves, intersections and areas have closed forms. Source: K. M. Bolton, Biarc curves, Computer-Aided Design
7(2), 1975. The approximation error is proportional to the third power of the spacing of the points, and to the rate of
change of the curvature.
"""

from itertools import pairwise
from math import atan2, hypot, pi, sqrt

from fingervision.rendering.arc import Arc
from fingervision.rendering.line import Line
from fingervision.rendering.outline import Piece
from fingervision.rendering.plane import Points

# An arc that deviates less than this from its chord becomes a line, because its centre would be too far away for the
# precision of the computation.
STRAIGHT_PX = 2e-8


def biarcs(points: Points, tangents: Points) -> tuple[Piece, ...]:
    """Lines and arcs through the points with the given directions of travel.

    Parameters
    ----------
    points, tangents : ndarray of float, shape (n, 2)
        Points of the curve, and vectors along it there, of any length.

    Returns
    -------
    tuple of Line or Arc
        Two pieces for each pair of neighbours.
    """
    pieces: list[Piece] = []
    knots = []
    for (x, y), (tx, ty) in zip(points.tolist(), tangents.tolist(), strict=True):
        size = hypot(tx, ty)
        knots.append((x, y, tx / size, ty / size))
    for (x0, y0, tx0, ty0), (x1, y1, tx1, ty1) in pairwise(knots):
        # The tangents of the two ends meet in the joint if each is followed over the length d, which solves
        # |chord|^2 - 2 d chord . (t0 + t1) - 2 d^2 (1 - t0 . t1) = 0.
        chord_x, chord_y = x1 - x0, y1 - y0
        a = 2 * (1 - (tx0 * tx1 + ty0 * ty1))
        b = 2 * (chord_x * (tx0 + tx1) + chord_y * (ty0 + ty1))
        c = chord_x * chord_x + chord_y * chord_y
        d = 2 * c / (b + sqrt(b * b + 4 * a * c))
        joint = ((x0 + d * tx0 + x1 - d * tx1) / 2, (y0 + d * ty0 + y1 - d * ty1) / 2)
        pieces.append(_arc((x0, y0), joint, (tx0, ty0)))
        pieces.append(_arc((x1, y1), joint, (-tx1, -ty1)).backwards())
    return tuple(pieces)


def _arc(start: tuple[float, float], end: tuple[float, float], tangent: tuple[float, float]) -> Piece:
    """Return the arc that starts at `start` in the direction of the unit vector `tangent` and ends at `end`."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    aside = tangent[0] * dy - tangent[1] * dx
    if abs(aside) < 4 * STRAIGHT_PX:
        return Line(*start, *end)
    radius = (dx * dx + dy * dy) / (2 * aside)
    x, y = start[0] - radius * tangent[1], start[1] + radius * tangent[0]
    first, last = atan2(start[1] - y, start[0] - x), atan2(end[1] - y, end[0] - x)
    return Arc(x, y, abs(radius), first, (last - first + pi) % (2 * pi) - pi)

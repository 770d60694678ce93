"""Step 6 for fingers with cut corners: the outline near the measuring point and at the tip as straight lines.

A chamfered corner is a straight side of its own between top and flank. Near the measuring point the outline is then
fitted by a straight line, as long as the residuals allow; the tip is the higher end of the line fitted to the top.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints

Floats = NDArray[np.float64]

# Half-lengths of the line through the measuring point that are tried (pixels along), and so many blurs at least: a
# corner that is nearer bends it.
REACHES_PX, SHORTEST_IN_BLURS = (12.0, 10.0, 8.0, 6.0, 5.0), 3.0
FEWEST_POINTS = 7
# Points lie on a straight line where their mean square, in units of their own, is below this: no dust, no curve.
STRAIGHT = 3.0
# The top is taken from the middle part of what lies within so many pixels below the outermost point, and reaches as far
# as points lie within so many pixels of its line.
TOP_PX, MIDDLE_SHARE, ON_TOP_PX = 6.0, 0.6, 0.5
# The end of the top is known to this (standard uncertainty, pixels), and a top leans no more than this (slope).
U_END_PX, STEEPEST_TOP = 1.0, 0.35
# A side that leans more crosses no height well (across over along).
FLATTEST = 2.0


def cornered_measuring_point(points: OutlinePoints, below_tip_px: float, shared: float) -> MeasuringPoint | None:
    """Tip and edge of a finger with straight sides and corners of any kind; None where the sides are not straight.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline.
    below_tip_px : float
        Height of measuring below the tip.
    shared : float
        Neighbouring points that share their errors.
    """
    tip = _tip(points)
    if tip is None:
        return None
    height, var_tip, apex = tip
    side = _side(points, height + below_tip_px, apex)
    if side is None:
        return None
    edge, slope, var_edge = side
    var_tip *= shared
    var_edge = shared * var_edge + slope**2 * var_tip
    covariance = np.array([[var_tip, slope * var_tip], [slope * var_tip, var_edge]])
    return MeasuringPoint(height, apex, edge, slope, covariance)


def _line(t: Floats, v: Floats, u: Floats) -> tuple[Floats, Floats, float]:
    """Weighted line v = c + m t: (c, m), their covariance, and the mean squared residual."""
    powers = np.column_stack((np.ones_like(t), t))
    scaled = powers / u[:, None] ** 2
    covariance: Floats = np.asarray(np.linalg.pinv(scaled.T @ powers), dtype=float)
    found = covariance @ scaled.T @ v
    square = float(np.sum(((v - powers @ found) / u) ** 2) / max(t.size - 2, 1))
    return found, covariance * max(square, 1.0), square


def _tip(points: OutlinePoints) -> tuple[float, float, float] | None:
    """Height of the outermost point, its variance, and its position across the finger."""
    is_top = ~points.is_row & (points.y < points.y.min() + TOP_PX)
    if np.count_nonzero(is_top) < 2 * FEWEST_POINTS:
        return None
    x, y, u = points.x[is_top], points.y[is_top], points.u[is_top]
    centre = float(np.median(x))
    near = np.abs(x - centre) <= 0.5 * MIDDLE_SHARE * (x.max() - x.min())
    if np.count_nonzero(near) < FEWEST_POINTS:
        return None
    (c, m), covariance, square = _line(x[near] - centre, y[near], u[near])
    if square > STRAIGHT or abs(m) > STEEPEST_TOP:
        return None
    on = np.abs(y - c - m * (x - centre)) < ON_TOP_PX
    ends = [float(x[on].min()) - centre, float(x[on].max()) - centre]
    end = min(ends, key=lambda at: m * at)
    variance = covariance[0, 0] + 2.0 * end * covariance[0, 1] + end**2 * covariance[1, 1] + (m * U_END_PX) ** 2
    return float(c + m * end), float(variance), end + centre


def _side(points: OutlinePoints, height: float, apex: float) -> tuple[float, float, float] | None:
    """Position of the inner side at a height, its slope, and its variance."""
    inner = points.x > min(apex, float(np.median(points.x)))
    blur = float(np.median(points.blur))
    for reach in REACHES_PX:
        if reach < SHORTEST_IN_BLURS * blur:
            return None
        near = inner & (np.abs(points.y - height) <= reach)
        if np.count_nonzero(near) < FEWEST_POINTS:
            continue
        t, v, u = points.y[near] - height, points.x[near], points.u[near]
        (_, m), _, _ = _line(t, v, u)
        # A point that was found along a column moves across by the slope.
        across = np.where(points.is_row[near], 1.0, max(abs(m), 0.05))
        (c, m), covariance, square = _line(t, v, u * across)
        if square <= STRAIGHT and abs(m) <= FLATTEST and t.min() < -0.5 * reach and t.max() > 0.5 * reach:
            return float(c), float(m), float(covariance[0, 0])
    return None

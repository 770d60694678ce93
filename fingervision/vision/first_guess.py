"""Initial estimate of a finger's end from its points: a line through each side, and the radii of the corners."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.finger_shape import (
    PARAMETERS,
)
from fingervision.vision.outline_points import OutlinePoints

Floats = NDArray[np.float64]

# Least number of points of a line.
FEWEST_POINTS = 4
# Largest difference in slope of two flanks; standard uncertainty with which an invisible flank is assumed to be
# parallel to the visible flank.
MOST_TAPER, TAPER_PRIOR = 0.15, 0.03
# Standard uncertainty (slope) with which the sides of a single visible corner are assumed to be perpendicular.
SQUARE_PRIOR = 0.01
# Standard uncertainty of the prior of a side's slope about its initial estimate.
SLOPE_PRIOR = 0.3
# Assumed distance (pixels) of an invisible flank beyond the outermost column, with a standard uncertainty of one pixel.
BEYOND_BORDER_PX = 3.0
# Standard uncertainty (in sigma) of the radius of a fillet that is too small to be resolved.
SHARP_PRIOR_IN_BLURS = 1.0
# Distance of a sharp corner's half-level from the vertex (in sigma); distance (pixels) inside both sides at which
# points belong to a fillet.
SHARP_CORNER, INSIDE_CORNER_PX = 0.7706, 0.5
# Distance of a fillet of radius 1 from the vertex of a right-angled corner.
CORNER_RETREAT = 2.0**0.5 - 1.0

_guess = loop("first_guess_guess")
_line = loop("first_guess_line")


def first_guess(points: OutlinePoints, below_tip_px: float) -> tuple[Floats, Floats, Floats]:
    """Starting values for the fit of a finger's end.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline of the finger.
    below_tip_px : float
        Distance of the measuring point below the tip.

    Returns
    -------
    start, origin, u_prior : ndarray of float, shape (8,), (2,), (8,)
        Arguments for `fit_finger_end`.
    """
    start, origin, u_prior = np.empty(PARAMETERS), np.empty(2), np.empty(PARAMETERS)
    _guess(points.x, points.y, points.side, points.blur[0], below_tip_px, start, origin, u_prior)
    return start, origin, u_prior


def line(t: Floats, v: Floats) -> tuple[float, float]:
    """Least-squares line v = c + m t, as (c, m); slope 0 where all t are equal."""
    c, m = _line(np.ascontiguousarray(t), np.ascontiguousarray(v))
    return c, m

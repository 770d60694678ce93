"""Initial estimate of a finger's end from its points: a line through each side, and the radii of the corners."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.finger_shape import (
    PARAMETERS,
)
from fingervision.vision.outline_points import OutlinePoints

Floats = NDArray[np.float64]

# A line needs so many points.
FEWEST_POINTS = 4
# Flanks that differ more in slope are not both flanks; one that is not in view is parallel to the other within this.
MOST_TAPER, TAPER_PRIOR = 0.15, 0.03
# Where only one corner is in view, its sides are square to each other within this.
SQUARE_PRIOR = 0.01
# A side's slope is not far from what its points say at first sight.
SLOPE_PRIOR = 0.3
# A flank that no point speaks of lies so far beyond the outermost column, give or take a pixel.
BEYOND_BORDER_PX = 3.0
# A fillet that is blurred into its corner has its radius from the corner alone, to so many sigma.
SHARP_PRIOR_IN_BLURS = 1.0
# A sharp corner's half-level stays away by so many sigma; points that lie so far inside both sides are on a fillet.
SHARP_CORNER, INSIDE_CORNER_PX = 0.7706, 0.5
# Distance of a fillet of radius one from its corner.
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

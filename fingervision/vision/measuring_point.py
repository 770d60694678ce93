"""Step 7: locate the measuring point on the fitted finger end.

Its height is measured from the tip, its lateral position is that of the inner edge below the tip.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.finger_end import FingerEnd

Floats = NDArray[np.float64]

# A top is square to its flanks where it is so within this many sigma; it then is to this (slope).
SQUARE_IN_SIGMAS, U_SQUARE = 2.5, 3e-4
# A top whose two corners differ in height by less than so many sigma is level
# (a corner that is not in view says nothing: never by more than this).
LEVEL_IN_SIGMAS, LEVEL_LIMIT_PX = 2.0, 0.5
# A corner that is blurred out, or nearly so, has its radius to so many sigma (standard uncertainty); nothing of it is
# hidden from so many sigma on.
U_CORNER_IN_BLURS, HIDDEN_IN_BLURS = 0.8, 8.0
# Where no point of the outline lies on a fillet, its covariance is that of the guess, beyond this radius (pixels). The
# fillet is then no larger than was found, give or take so many sigma of blur: a larger one would reach the points.
UNSEEN_PX, UNSEEN_IN_BLURS = 100.0, 2.0
# Derivatives are taken over so much of each parameter to either side.
STEP = 1e-3
# For a radius that is its own uncertainty, up to so many pixels.
LARGEST_STEP_PX = 2.0

_squared = loop("measuring_point_squared")
_read_off = loop("measuring_point_read_off")


@dataclass(frozen=True, slots=True, eq=False)
class MeasuringPoint:
    """One finger's measuring point in the finger's own axes, relative to its origin.

    Parameters
    ----------
    tip, apex : float
        Height of the tip (coordinate along the finger), and position of the tip across the finger.
    edge, slope : float
        Position of the inner edge at the measuring height, and its change per pixel towards the root.
    covariance : ndarray of float, shape (2, 2)
        Covariance of (tip, edge).
    """

    tip: float
    apex: float
    edge: float
    slope: float
    covariance: Floats


def squared(end: FingerEnd) -> FingerEnd:
    """Return the fitted finger end with its top made perpendicular to its flanks, unless the points contradict this.

    The top of a finger that is cut straight is perpendicular to its flanks, which are long and determine the tilt far
    more precisely than the short top. If the directions of top and flanks agree within their uncertainty, they are
    combined (a Kalman update); a slanted top is not changed.
    """
    parameters, covariance = np.empty_like(end.parameters), np.empty_like(end.covariance)
    _squared(end.parameters, end.covariance, end.misfit, parameters, covariance)
    return FingerEnd(parameters, covariance, end.origin, end.misfit, end.residual, end.robust)


def measuring_point(end: FingerEnd, below_tip_px: float, blur_px: float) -> MeasuringPoint:
    """Tip and inner edge of a fitted finger end, with their covariance from that of the fit's parameters.

    The tip is the higher of the two corners of the top. For a level top, noise would decide which corner is higher, and
    the tip would be too high on average; therefore a top that is level within twice its uncertainty is treated as
    exactly level.
    """
    covariance = np.empty((2, 2))
    shape = (end.parameters, end.covariance, end.misfit, end.origin)
    tip, apex, edge, slope = _read_off(*shape, below_tip_px, blur_px, covariance)
    return MeasuringPoint(tip, apex, edge, slope, covariance)

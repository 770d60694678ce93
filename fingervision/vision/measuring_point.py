"""Step 7: locate the measuring point on the fitted finger end.

The height of the measuring point is measured from the tip; its lateral position is that of the inner edge at this
height.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.finger_end import FingerEnd

Floats = NDArray[np.float64]

# Number of standard uncertainties within which a top is regarded as perpendicular to its flanks, and the standard
# uncertainty (slope) that is then assumed.
SQUARE_IN_SIGMAS, U_SQUARE = 2.5, 3e-4
# Number of standard uncertainties within which the two corners of a level top may differ in height, and largest
# difference (pixels), because an invisible corner has a large uncertainty.
LEVEL_IN_SIGMAS, LEVEL_LIMIT_PX = 2.0, 0.5
# Standard uncertainty (in sigma) of the radius of a corner that blur hides, and radius (in sigma) from which blur hides
# nothing.
U_CORNER_IN_BLURS, HIDDEN_IN_BLURS = 0.8, 8.0
# Standard uncertainty of a radius (pixels) above which no point of the outline determines the fillet. The radius is
# then not larger than the fitted one by more than this multiple of the blur, because a larger fillet would reach the
# points.
UNSEEN_PX, UNSEEN_IN_BLURS = 100.0, 2.0
# Step of the numerical derivatives, to either side.
STEP = 1e-3
# For a radius, the step is its uncertainty, up to this number of pixels.
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
    more precisely than the short top. If the measured angle between top and flanks is 90 degrees within its
    uncertainty, the right angle is imposed (a Kalman update); a slanted top is not changed.
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

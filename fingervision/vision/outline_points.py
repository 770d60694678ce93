"""The sub-pixel outline of one finger, in that finger's own axes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edges import EdgePoints
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.median import middle
from fingervision.vision.profile_lines import PLACES, SIDE, TIP_SIDE

Floats = NDArray[np.float64]

# Slope above which rows and columns cross the same part of an outline, and factor by which the uncertainty of these
# points is increased.
SHARED_SLOPE, SHARED_FACTOR = 0.75, 1.25
# Least contrast of a line as a share of the typical contrast; a line with less contrast crosses the border of the
# picture instead of a finger's edge.
LEAST_CONTRAST = 0.3

_seen_from = loop("outline_points_seen_from")


@dataclass(frozen=True, slots=True, eq=False)
class OutlinePoints:
    """Points of one finger's half-level outline, with the inner side at larger `x`; arrays of shape (n,).

    Parameters
    ----------
    x, y : ndarray of float
        Coordinates across (positive inwards) and along the finger (positive towards the root), relative to the finger's
        own origin.
    u : ndarray of float
        Standard uncertainty along the line of pixels on which the point was found.
    side : ndarray of int
        Side of the coarse outline to which that line belongs: 0 inner flank, 1 tip, 2 outer flank.
    blur : ndarray of float
        Gaussian sigma of the optics at the point, the pixel's width included.
    """

    x: Floats
    y: Floats
    u: Floats
    side: NDArray[np.int_]
    blur: Floats

    @property
    def is_row(self) -> NDArray[np.bool_]:
        """Whether the point was found on a row across the flank (otherwise on a column across the tip)."""
        return np.asarray(self.side != TIP_SIDE)


def finger_origin(finger: CoarseFinger) -> tuple[int, int]:
    """Origin of a finger's own axes, (across, along) in the picture."""
    return int(finger.outline[0, 0]), finger.top_along_px


def outline_points(fingers: CoarseFingers, edges: EdgePoints) -> tuple[OutlinePoints, OutlinePoints]:
    """Points of the left and of the right finger, each in that finger's own axes."""
    lines = edges.lines
    least = LEAST_CONTRAST * middle(np.abs(edges.contrast[lines.weight > 0]))
    seen = (SIDE, lines.weight, edges.contrast, lines.fixed, edges.position, edges.u_position, lines.slope)
    found = []
    for k, finger in enumerate((fingers.left, fingers.right)):
        x, y, u, blur = np.empty((4, PLACES))
        side = np.empty(PLACES, dtype=np.int64)
        axes = (finger.inner_sign, *finger_origin(finger))
        n = _seen_from(*seen, edges.curvature_gain, edges.blur_px, k, least, *axes, x, y, u, blur, side)
        found.append(OutlinePoints(x[:n], y[:n], u[:n], side[:n], blur[:n]))
    return found[0], found[1]

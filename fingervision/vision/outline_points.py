"""The sub-pixel outline of one finger, seen from the finger itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edges import EdgePoints
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.median import middle
from fingervision.vision.outline_blur import outline_blur
from fingervision.vision.profile_lines import SIDE, TIP_SIDE

Floats = NDArray[np.float64]

# Where the outline runs at 45 degrees, rows and columns look at the same pixels: each counts for less.
SHARED_SLOPE, SHARED_FACTOR = 0.75, 1.25
# A line whose contrast is below this share of the typical one meets the border of the picture, not of a finger.
LEAST_CONTRAST = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class OutlinePoints:
    """Points of one finger's half-level outline, with its inner side at larger `x`; arrays of shape (n,).

    Parameters
    ----------
    x, y : ndarray of float
        Across (inwards positive) and along (to the root positive), relative to the finger's own origin.
    u : ndarray of float
        Standard uncertainty along the line on which the point was found.
    side : ndarray of int
        Which side of the coarse outline that line belongs to: 0 inner flank, 1 tip, 2 outer flank.
    blur : ndarray of float
        Gaussian sigma of the optics at the point, the pixel included.
    """

    x: Floats
    y: Floats
    u: Floats
    side: NDArray[np.int_]
    blur: Floats

    @property
    def is_row(self) -> NDArray[np.bool_]:
        """Whether the point was found on a row."""
        return np.asarray(self.side != TIP_SIDE)


def finger_origin(finger: CoarseFinger) -> tuple[int, int]:
    """Where a finger's own axes begin, (across, along) in the picture."""
    return int(finger.outline[0, 0]), finger.top_along_px


def outline_points(fingers: CoarseFingers, edges: EdgePoints) -> tuple[OutlinePoints, OutlinePoints]:
    """Points of the left and of the right finger, each in its own axes."""
    lines, height = edges.lines, np.abs(edges.contrast)
    blur = outline_blur(edges.blur_px, lines.slope, edges.curvature_gain)
    typical = middle(height[lines.weight > 0])
    is_point = (lines.weight > 0) & (height > LEAST_CONTRAST * typical)
    is_shared = np.abs(lines.slope) > SHARED_SLOPE
    left, right = (
        _seen_from(
            finger, np.flatnonzero(is_point[k]), lines.fixed[k], edges.position[k], edges.u_position[k], is_shared[k],
            blur[k],
        )
        for k, finger in enumerate((fingers.left, fingers.right))
    )  # fmt: skip
    return left, right


def _seen_from(
    finger: CoarseFinger,
    chosen: NDArray[np.int_],
    fixed: NDArray[np.int_],
    position: Floats,
    u_position: Floats,
    is_shared: NDArray[np.bool_],
    blur: Floats,
) -> OutlinePoints:
    """The chosen points in the finger's own axes."""
    across0, along0 = finger_origin(finger)
    side, line, found = SIDE[chosen], fixed[chosen], position[chosen]
    is_row = side != TIP_SIDE
    return OutlinePoints(
        x=finger.inner_sign * (np.where(is_row, found, line) - across0),
        y=np.where(is_row, line, found) - along0,
        u=u_position[chosen] * np.where(is_shared[chosen], SHARED_FACTOR, 1.0),
        side=side,
        blur=blur[chosen],
    )

"""Two fingers as signed distances, and what they truly are apart."""

from dataclasses import dataclass
from math import cos, hypot, radians, sin

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Finger:
    """A half-infinite bar with a flat or rounded end, turned by a few degrees.

    Parameters
    ----------
    across_px, tip_px : float
        Middle of the bar's end before it is turned about that point.
    width_px, radius_px : float
        Breadth of the bar, and radius of its two corners (at most half of the breadth).
    tilt_deg : float
        Turn in the picture.
    """

    across_px: float
    tip_px: float
    width_px: float
    radius_px: float
    tilt_deg: float = 0.0

    def distance(self, x: Floats, y: Floats) -> Floats:
        """Signed distance from the outline, negative inside (pixels)."""
        u, v = self._own(x, y)
        qx, qy = np.abs(u) - (0.5 * self.width_px - self.radius_px), self.radius_px - v
        outside = np.hypot(np.maximum(qx, 0.0), np.maximum(qy, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(qx, qy), 0.0) - self.radius_px)

    def tip(self) -> float:
        """Height of the outermost point."""
        return min(
            self._world(side * (0.5 * self.width_px - self.radius_px), self.radius_px)[1] - self.radius_px
            for side in (-1.0, 1.0)
        )

    def crossing(self, height: float, side: float) -> float:
        """Where the outline crosses a row, on the right (+1) or the left (-1) of the bar."""
        middle = self.across_px - sin(radians(self.tilt_deg)) * (height - self.tip_px)
        return float(
            brentq(lambda x: float(self.distance(np.array(x), np.array(height))), middle, middle + side * self.width_px)
        )

    def _own(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        c, s = cos(radians(self.tilt_deg)), sin(radians(self.tilt_deg))
        dx, dy = x - self.across_px, y - self.tip_px
        return c * dx + s * dy, c * dy - s * dx

    def _world(self, u: float, v: float) -> tuple[float, float]:
        c, s = cos(radians(self.tilt_deg)), sin(radians(self.tilt_deg))
        return self.across_px + c * u - s * v, self.tip_px + s * u + c * v


def true_gap(left: Finger, right: Finger, below_px: float) -> float:
    """Distance between the inner edges, each so far below its own finger's tip."""
    heights = [finger.tip() + below_px for finger in (left, right)]
    inner = left.crossing(heights[0], 1.0), right.crossing(heights[1], -1.0)
    return hypot(inner[1] - inner[0], heights[1] - heights[0])

"""Uncertainty of a body's pose: from its own edges in each frame, and from errors common to all frames.

Common errors are those of the drawing's placement (itself a fit), the scale, the edge bias, lens and plane. A pose is
counted from the drawing, so that an error of the scale grows with the distance from the features by which the drawing
was placed.
"""

from dataclasses import dataclass
from math import hypot, pi

import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.plane_scale import PlaneScale
from fingervision.measuring.body_outlines import Placement
from fingervision.vision.rigid_outline import RigidFit

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SharedErrors:
    """Errors of poses that are common to all frames.

    Parameters
    ----------
    laid : RigidFit or None
        The fit by which the drawing was laid; None where it was laid exactly.
    about_px : ndarray of float, shape (2,)
        The point about which it was fitted, on the flat plane.
    plane : PlaneScale or None
        The calibration with its budget; None where nothing is known of it.
    u_response_px : float
        What an unknown camera response leaves open of where an edge is seen.
    size_error : float
        By how much bodies are seen larger or smaller than drawn: an error of the scale, or of the drawing.
    """

    laid: RigidFit | None
    about_px: Array
    plane: PlaneScale | None
    u_response_px: float = 0.0
    size_error: float = 0.0

    def at(self, size_px: tuple[int, int]) -> tuple[float, float]:
        """Standard uncertainties of edges' positions (px) and of sizes (relative), in the centre of a picture."""
        if self.plane is None:
            return 0.0, self.size_error
        return self.plane.u_edge_px(self.u_response_px), self._relative((0.5 * size_px[0], 0.5 * size_px[1]))

    def _relative(self, at: tuple[float, float]) -> float:
        if self.plane is None:
            return self.size_error
        return max(self.plane.relative_u(at, 0.0), self.plane.relative_u(at, 0.5 * pi), self.size_error)

    def of_pose(self, fit: RigidFit, about_px: Array, in_picture: Array) -> "SharedPose":
        """Compute the effect of the common errors on one pose.

        Parameters
        ----------
        fit : RigidFit
            The body's motion.
        about_px : ndarray of float, shape (2,)
            Its reference point where it is drawn, on the flat plane.
        in_picture : ndarray of float, shape (2,)
            The same point as the picture shows it now.
        """
        arm = about_px + fit.shift_px - self.about_px
        # A drawing that was laid off by a shift and a turn puts the body's reference point off by both.
        carried = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]])
        placed, shadows = np.zeros((3, 3)), fit.by_shadows
        outward, scale = fit.by_outward, fit.by_scale + np.array([arm[0], arm[1], 0.0])
        if self.laid is not None:
            placed = carried @ (self.laid.covariance + self.laid.by_shadows) @ carried.T
            outward = outward - carried @ self.laid.by_outward
            scale = scale - carried @ self.laid.by_scale
        if self.plane is None:
            return SharedPose(placed, np.zeros(3), self.size_error * scale, shadows, 0.0)
        at = (float(in_picture[0]), float(in_picture[1]))
        u_edge_px = self.plane.u_edge_px(self.u_response_px)
        return SharedPose(placed, u_edge_px * outward, self._relative(at) * scale, shadows, self.plane.u_angle_rad)


@dataclass(frozen=True, slots=True, eq=False)
class SharedPose:
    """Effect of the common errors on one pose, in pixels and rad.

    Parameters
    ----------
    placed : ndarray of float, shape (3, 3)
        Covariance by where the drawing was laid.
    by_bias, by_scale : ndarray of float, shape (3,)
        What one standard uncertainty of the edges' bias and of the scale does.
    by_shadows : ndarray of float, shape (3, 3)
        Covariance by what may lie along some of the body's own edges.
    u_angle_rad : float
        What tilt and lens leave open of an angle.
    """

    placed: Array
    by_bias: Array
    by_scale: Array
    by_shadows: Array
    u_angle_rad: float

    @property
    def covariance(self) -> Array:
        """Covariance of all common errors together, shape (3, 3)."""
        own = (
            self.placed
            + self.by_shadows
            + np.outer(self.by_bias, self.by_bias)
            + np.outer(self.by_scale, self.by_scale)
        )
        own[2, 2] += self.u_angle_rad**2
        return own

    def u_turn_against(self, other: "SharedPose") -> float:
        """Standard uncertainty, common to all frames, of the angle between two bodies (rad).

        The placement's error cancels.
        """
        bias = float(self.by_bias[2] - other.by_bias[2])
        scale = float(self.by_scale[2] - other.by_scale[2])
        shadows = max(float(self.by_shadows[2, 2] + other.by_shadows[2, 2]), 0.0) ** 0.5
        return hypot(bias, scale, shadows, max(self.u_angle_rad, other.u_angle_rad))


def in_drawing(place: Placement) -> Array:
    """Matrix that converts (x px, y px, rad) of the flat plane to (x mm, y mm, mrad) of the drawing's axes."""
    into = np.zeros((3, 3))
    into[:2, :2] = place.axes.T / place.px_per_mm
    into[2, 2] = 1e3 * place.turn_sign
    return into

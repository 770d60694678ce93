"""Uncertainty of a body's pose: from its own edges in each frame, and from errors that all frames share.

Errors that all frames share are those of the drawing's placement in the picture, the scale, the edge bias, lens and
plane. A pose is measured relative to the drawing, so that the effect of a scale error grows with the distance from the
edges by which the drawing was placed.
"""

from dataclasses import dataclass
from math import hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.plane_scale import PlaneScale
from fingervision.measuring.body_outlines import Placement
from fingervision.vision.rigid_outline import RigidFit

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SharedErrors:
    """Errors of poses that all frames share.

    Parameters
    ----------
    laid : RigidFit or None
        Fit by which the drawing was placed; None if it was placed exactly.
    about_px : ndarray of float, shape (2,)
        Point about which the rotation was fitted, in the undistorted plane.
    plane : PlaneScale or None
        Calibration with its uncertainty budget; None if not known.
    u_response_px : float
        Standard uncertainty of the edges' positions due to an unknown camera response.
    size_error : float
        Relative difference of the bodies' sizes from the drawing: an error of the scale, or of the drawing.
    """

    laid: RigidFit | None
    about_px: Array
    plane: PlaneScale | None
    u_response_px: float = 0.0
    size_error: float = 0.0

    def at(self, size_px: tuple[int, int]) -> tuple[float, float]:
        """Standard uncertainties of edge positions (px) and of sizes (relative), at the centre of a picture."""
        if self.plane is None:
            return 0.0, self.size_error
        return self.plane.u_edge_px(self.u_response_px), self._relative((0.5 * size_px[0], 0.5 * size_px[1]))

    def _relative(self, at: tuple[float, float]) -> float:
        if self.plane is None:
            return self.size_error
        return max(self.plane.relative_u(at, 0.0), self.plane.relative_u(at, 0.5 * pi), self.size_error)

    def of_pose(self, fit: RigidFit, about_px: Array, in_picture: Array) -> "SharedPose":
        """Compute the effect of the shared errors on one pose.

        Parameters
        ----------
        fit : RigidFit
            Fit of the body's motion.
        about_px : ndarray of float, shape (2,)
            Drawn position of the body's reference point, in the undistorted plane.
        in_picture : ndarray of float, shape (2,)
            Present position of the reference point in the picture.
        """
        arm = about_px + fit.shift_px - self.about_px
        # Errors of the drawing's shift and rotation both displace the body's reference point.
        carried = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]])
        placed, shadows = np.zeros((3, 3)), fit.by_shadows
        turn_rad = fit.angle_rad
        outward, scale = fit.by_outward, fit.by_scale + np.array([arm[0], arm[1], 0.0])
        if self.laid is not None:
            placed = carried @ _root(self.laid.covariance + self.laid.by_shadows)
            outward = outward - carried @ self.laid.by_outward
            scale = scale - carried @ self.laid.by_scale
        if self.plane is None:
            return SharedPose(placed, np.zeros(3), self.size_error * scale, shadows, 0.0, turn_rad)
        at = (float(in_picture[0]), float(in_picture[1]))
        u_edge_px = self.plane.u_edge_px(self.u_response_px)
        u_angle_rad = self.plane.u_angle_rad
        return SharedPose(placed, u_edge_px * outward, self._relative(at) * scale, shadows, u_angle_rad, turn_rad)


def _root(covariance: Array) -> Array:
    """Return a matrix whose product with its own transpose is the covariance."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


@dataclass(frozen=True, slots=True, eq=False)
class SharedPose:
    """Effect of the shared errors on one pose, in pixels and rad.

    Parameters
    ----------
    by_placement : ndarray of float, shape (3, 3)
        Changes of the pose, in columns, by one standard uncertainty of each independent error of the drawing's
        placement.
    by_bias, by_scale : ndarray of float, shape (3,)
        Change of the pose by one standard uncertainty of the edge bias, and of the scale.
    by_shadows : ndarray of float, shape (3, 3)
        Covariance due to possible shadows along some of the body's own edges.
    u_angle_rad : float
        Standard uncertainty of an angle due to camera tilt and lens.
    turn_rad : float
        Rotation of the body.
    """

    by_placement: Array
    by_bias: Array
    by_scale: Array
    by_shadows: Array
    u_angle_rad: float
    turn_rad: float

    def since(self, first: "SharedPose") -> "SharedPose":
        """Effect of the shared errors on the motion between an earlier frame and this one.

        What displaces the body alike in both frames cancels. Tilt and lens change an angle in proportion to it. A
        shadow may lie differently in each frame.
        """
        return SharedPose(
            self.by_placement - first.by_placement,
            self.by_bias - first.by_bias,
            self.by_scale - first.by_scale,
            self.by_shadows + first.by_shadows,
            self.u_angle_rad * abs(sin(self.turn_rad - first.turn_rad)),
            self.turn_rad - first.turn_rad,
        )

    @property
    def covariance(self) -> Array:
        """Covariance of all shared errors together, shape (3, 3)."""
        own = (
            self.by_placement @ self.by_placement.T
            + self.by_shadows
            + np.outer(self.by_bias, self.by_bias)
            + np.outer(self.by_scale, self.by_scale)
        )
        own[2, 2] += self.u_angle_rad**2
        return own

    def u_turn_against(self, other: "SharedPose") -> float:
        """Standard uncertainty (rad) that all frames share, of the angle between two bodies.

        The error of the drawing's placement cancels in an angle between two bodies.
        """
        bias = float(self.by_bias[2] - other.by_bias[2])
        scale = float(self.by_scale[2] - other.by_scale[2])
        shadows = max(float(self.by_shadows[2, 2] + other.by_shadows[2, 2]), 0.0) ** 0.5
        return hypot(bias, scale, shadows, max(self.u_angle_rad, other.u_angle_rad))


def in_drawing(place: Placement) -> Array:
    """Matrix that converts (px, px, rad) in the undistorted plane to (mm, mm, mrad) in the drawing's axes."""
    into = np.zeros((3, 3))
    into[:2, :2] = place.axes.T / place.px_per_mm
    into[2, 2] = 1e3 * place.turn_sign
    return into

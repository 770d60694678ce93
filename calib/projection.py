"""Projection of a flat scene into the picture: distortion by the lens, and perspective of the plane."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calib.short_repr import ShortRepr

Floats = NDArray[np.float64]

# Steps of the fixed-point iteration that inverts the distortion; for ordinary lenses each step improves the result by
# about one digit.
UNDISTORT_STEPS = 25


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Lens(ShortRepr):
    """Radial and tangential distortion by the model of Brown (Photogrammetric Engineering 37(8), 1971, 855-866).

    Parameters
    ----------
    parameters : ndarray, shape (9,)
        Focal lengths f_x, f_y and principal point c_x, c_y in pixels, then k1, k2, p1, p2, k3.
    covariance : ndarray, shape (9, 9)
        Covariance of `parameters`; zero rows for parameters that were held fixed.
    """

    parameters: Floats
    covariance: Floats

    @property
    def camera_matrix(self) -> Floats:
        """Camera matrix of the pinhole camera, shape (3, 3), pixels."""
        f_x, f_y, c_x, c_y = self.parameters[:4]
        return np.array([[f_x, 0.0, c_x], [0.0, f_y, c_y], [0.0, 0.0, 1.0]])

    def undistort(self, points_px: Floats) -> Floats:
        """Map points to their positions without distortion, in the same pinhole camera.

        Parameters
        ----------
        points_px : ndarray, shape (..., 2)
            Measured points.

        Returns
        -------
        ndarray, shape (..., 2)
            Positions without distortion, in pixels.
        """
        f_x, f_y, c_x, c_y, k1, k2, p1, p2, k3 = self.parameters
        seen_x, seen_y = (points_px[..., 0] - c_x) / f_x, (points_px[..., 1] - c_y) / f_y
        x, y = seen_x, seen_y
        for _ in range(UNDISTORT_STEPS):
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            shift_x = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
            shift_y = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
            x, y = (seen_x - shift_x) / radial, (seen_y - shift_y) / radial
        return np.stack([x * f_x + c_x, y * f_y + c_y], axis=-1)

    def distort(self, points_px: Floats) -> Floats:
        """Map points of an undistorted pinhole camera to their distorted positions; the inverse of `undistort`."""
        f_x, f_y, c_x, c_y, k1, k2, p1, p2, k3 = self.parameters
        x, y = (points_px[..., 0] - c_x) / f_x, (points_px[..., 1] - c_y) / f_y
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        seen_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        seen_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.stack([seen_x * f_x + c_x, seen_y * f_y + c_y], axis=-1)

    def moved(self, index: int, step: float) -> "Lens":
        """Return the same lens with one parameter changed, for the propagation of `covariance`."""
        parameters = self.parameters.copy()
        parameters[index] += step
        return replace(self, parameters=parameters)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Plane(ShortRepr):
    """Homography from the picture to the plane, scaled so that the picture's centre stays in place.

    Source: Hartley & Zisserman, Multiple View Geometry, 2nd ed., 2.3.

    Parameters
    ----------
    homography : ndarray, shape (3, 3)
        Maps undistorted pixels to pixels of a picture taken perpendicular to the plane.
    """

    homography: Floats

    def flatten(self, points_px: Floats) -> Floats:
        """Map points to their positions in a camera perpendicular to the plane; `points_px` has shape (..., 2)."""
        return apply_homography(self.homography, points_px)

    def unflatten(self, points_px: Floats) -> Floats:
        """Map points of the plane to their positions in the picture; the inverse of `flatten`."""
        return apply_homography(np.asarray(np.linalg.inv(self.homography), dtype=np.float64), points_px)


def apply_homography(homography: Floats, points: Floats) -> Floats:
    """Map points of one plane to another; `points` has shape (..., 2)."""
    mapped = points @ homography[:, :2].T + homography[:, 2]
    return np.asarray(mapped[..., :2] / mapped[..., 2:])

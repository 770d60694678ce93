"""Plane of a flat scene: correction of perspective, after which a pixel has the same size everywhere."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
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

"""Pose of a body: the rigid motion that fits the motions of many of its points best."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MRAD = 1e3


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Position and rotation of a body relative to rest.

    Parameters
    ----------
    x_mm, y_mm : float
        Displacement of the body's reference point (the centroid of its area as drawn), in the drawing's axes.
    angle_mrad : float
        Rotation from x towards y.
    """

    x_mm: float
    y_mm: float
    angle_mrad: float


def rigid_motion(places_mm: Array, moved_mm: Array, weights: Array, about_mm: Array, *, large: bool) -> BodyPose:
    """Fit the rigid motion that leaves the smallest weighted sum of squared distances.

    For large displacements, the rotation is computed by the method of Kabsch (1976), Acta Crystallographica A 32, 922,
    DOI 10.1107/S0567739476001873, in the plane. For small displacements, the rotation is linearised, so that the pose
    is proportional to the displacements.

    Parameters
    ----------
    places_mm, moved_mm : ndarray of float, shape (2, n)
        Positions of the points at rest, and their displacements.
    weights : ndarray of float, shape (n,)
        Weight of each point, such as the area that it represents; not all zero.
    about_mm : ndarray of float, shape (2,)
        Reference point whose motion is returned.
    large : bool
        Whether the displacements are large.
    """
    share = weights / weights.sum()
    middle = places_mm @ share
    arm = places_mm - middle[:, None]
    mean = moved_mm @ share
    there = moved_mm - mean[:, None]
    reach = about_mm - middle
    across = float(share @ (arm[0] * there[1] - arm[1] * there[0]))
    if not large:
        angle = across / float(share @ np.sum(arm**2, axis=0))
        x, y = mean + angle * np.array([-reach[1], reach[0]])
        return BodyPose(float(x), float(y), MRAD * angle)
    angle = float(np.arctan2(across, share @ np.sum(arm * (arm + there), axis=0)))
    turn = np.array([[np.cos(angle) - 1.0, -np.sin(angle)], [np.sin(angle), np.cos(angle) - 1.0]])
    x, y = mean + turn @ reach
    return BodyPose(float(x), float(y), MRAD * angle)

"""Rigid-body transforms of compliance: equations (5) to (8) of Hricko & Havlik (2015), in six dimensions.

Equation (6), T = [[R, R P], [0, R]], is used as published: R rotates the axes, and P is the cross-product matrix of
equation (8) for the vector from the point whose motion is wanted to the point whose motion is known. In the
publication, equation (6) contains 6 by 6 matrices, but the compliance of equation (3) is planar, 3 by 3; in this module
every compliance is 6 by 6.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rotation_about_z(angle_rad: float) -> Array:
    """Equation (7): rotation matrix from axes rotated by the angle to the global axes."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def cross_matrix(arm_mm: Array) -> Array:
    """Equation (8): the matrix P with P v = p x v."""
    x, y, z = arm_mm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def carried(arm_mm: Array) -> Array:
    """Matrix from the motion of a rigid body at one point to its motion at another point.

    Parameters
    ----------
    arm_mm : ndarray of float, shape (3,)
        Vector from the point where the motion is known to the point where it is wanted.

    Returns
    -------
    ndarray of float, shape (6, 6)
        Matrix of u_wanted = u_known + theta x arm; its transpose transfers loads in the opposite direction.
    """
    matrix = np.eye(6)
    matrix[:3, 3:] = -cross_matrix(arm_mm)
    return matrix


def turned(angle_rad: float) -> Array:
    """Matrix that transforms displacements and rotations from a member's axes to global axes, shape (6, 6)."""
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = rotation_about_z(angle_rad)
    return matrix

"""Displacement of points in the picture per unit of each imperfection of the camera.

The camera's axis is assumed to pass through the centre of the picture.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def centre_px(frame_size_px: tuple[int, int]) -> Floats:
    """Centre of the picture, shape (2,), where the centre of the first pixel is (0, 0)."""
    return (np.array(frame_size_px, dtype=np.float64) - 1.0) / 2.0


def lens_shift_px(points_px: Floats, frame_size_px: tuple[int, int]) -> Floats:
    """Displacement by third-order radial distortion of 1 (100 %) of the radius at the picture's corner.

    Third-order distortion is the first term of Brown's series; `points_px` and the result have shape (..., 2).
    """
    middle = centre_px(frame_size_px)
    radius = points_px - middle
    return np.asarray(radius * np.sum(radius**2, axis=-1, keepdims=True) / np.sum(middle**2))


def tilt_shift_px(points_px: Floats, frame_size_px: tuple[int, int], distance_px: float, axis: int) -> Floats:
    """Displacement by perspective (px) per radian of tilt of the plane, to first order.

    For a plane tilted by t that recedes along x, at the distance Z, the point (x, y) appears at (x, y) / (1 - x t / Z).

    Parameters
    ----------
    points_px : ndarray, shape (..., 2)
        Points.
    frame_size_px : tuple of int
        Width and height.
    distance_px : float
        Distance of the camera's centre of projection from the plane, in pixels of the plane.
    axis : int
        0 for a plane that recedes along x, 1 along y.
    """
    radius = points_px - centre_px(frame_size_px)
    return np.asarray(radius * radius[..., axis : axis + 1] / distance_px)


def change_of_distance_px(points_px: Floats, shift_px: Floats) -> Floats:
    """Change of the distance between pairs of points, to first order.

    Parameters
    ----------
    points_px, shift_px : ndarray, shape (n, 2, 2)
        Points and their displacements, with the indices: pair, first or second point, x or y.

    Returns
    -------
    ndarray, shape (n,)
    """
    apart = points_px[:, 1] - points_px[:, 0]
    length = np.maximum(np.linalg.norm(apart, axis=1), np.finfo(float).tiny)
    return np.asarray(np.sum(apart * (shift_px[:, 1] - shift_px[:, 0]), axis=1) / length)

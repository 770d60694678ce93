"""Plane of a board and its scale, from one picture."""

from collections.abc import Callable
from dataclasses import dataclass
from math import degrees, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.board import BoardCorners
from calib.errors import CalibrationError
from calib.picture_shift import centre_px, lens_shift_px
from calib.plane import Plane, apply_homography

Floats = NDArray[np.float64]

# Half length (pixels) of the short distance at the picture's centre from which the scale is computed.
MIDDLE_PX = 1.0
# Step of numerical derivatives by a corner's position (pixels).
STEP_PX = 0.01
# Step of numerical derivatives by the distortion at the picture's corner.
STEP_LENS = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class PlaneFit:
    """A plane fitted to the corners in one picture.

    Parameters
    ----------
    plane : Plane
        Plane that removes the perspective.
    px_per_mm, u_px_per_mm : float
        Scale of the flattened picture, and its standard uncertainty from the corners' own scatter.
    by_lens : float
        Change of `px_per_mm` per unit of uncorrected lens distortion.
    residual_px : ndarray, shape (n, 2)
        Measured minus fitted positions of the corners.
    tilt_deg : float
        Tilt that would cause the observed shortening of one direction at the centre of the picture.
    """

    plane: Plane
    px_per_mm: float
    u_px_per_mm: float
    by_lens: float
    residual_px: Floats
    tilt_deg: float


def plane_from_board(corners: BoardCorners, ideal_px: Floats, frame_size_px: tuple[int, int]) -> PlaneFit:
    """Fit the homography of the board's plane.

    Parameters
    ----------
    corners : BoardCorners
        Corners of one picture.
    ideal_px : ndarray, shape (n, 2)
        The corners corrected for the lens, if it is known.
    frame_size_px : tuple of int
        Width and height.
    """
    middle = centre_px(frame_size_px)
    to_picture = _homography(corners.board_mm, ideal_px)
    plane, px_per_mm, stretch = _squared(to_picture, middle)
    residual = ideal_px - apply_homography(to_picture, corners.board_mm)
    freedom = max(residual.size - 8, 1)
    variance = float(np.sum(residual**2)) / freedom
    by_corner = _gradient(lambda points: _log_scales(_homography(corners.board_mm, points), middle), ideal_px)
    u_log = sqrt(variance * float(np.max(np.sum(by_corner**2, axis=(0, 1)))))
    bent = ideal_px + STEP_LENS * lens_shift_px(ideal_px, frame_size_px)
    by_lens = (_squared(_homography(corners.board_mm, bent), middle)[1] - px_per_mm) / STEP_LENS
    return PlaneFit(
        plane=plane,
        px_per_mm=px_per_mm,
        u_px_per_mm=px_per_mm * u_log,
        by_lens=by_lens,
        residual_px=residual,
        tilt_deg=degrees(float(np.arccos(min(1.0, stretch)))),
    )


def _homography(board_mm: Floats, points_px: Floats) -> Floats:
    homography, _ = cv2.findHomography(board_mm, points_px, 0)
    matrix = np.array(homography, dtype=np.float64)  # if there is no homography, the array is not a matrix
    if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)):
        raise CalibrationError(
            "The board's corners do not define a plane: at least four corners must not lie on a straight line."
        )
    return matrix


def _squared(to_picture: Floats, middle: Floats) -> tuple[Plane, float, float]:
    """Plane that keeps the centre and directions of the picture, its scale, and the ratio of extreme stretches."""
    to_board = np.asarray(np.linalg.inv(to_picture), dtype=np.float64)
    at = apply_homography(to_board, middle)
    steps = MIDDLE_PX * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    seen = apply_homography(to_board, middle + steps)
    board_per_px = np.column_stack([seen[0] - seen[1], seen[2] - seen[3]]) / (2.0 * MIDDLE_PX)
    px_per_mm = 1.0 / sqrt(abs(float(np.linalg.det(board_per_px))))
    # Rotation (and reflection) that is nearest to the picture's axes, by polar decomposition.
    left, stretches, right = np.linalg.svd(np.linalg.inv(board_per_px))
    turn = px_per_mm * (left @ right)
    to_flat = np.eye(3)
    to_flat[:2, :2], to_flat[:2, 2] = turn, middle - turn @ at
    homography = to_flat @ to_board
    return Plane(homography / homography[2, 2]), px_per_mm, float(stretches[1] / stretches[0])


def _log_scales(to_picture: Floats, middle: Floats) -> Floats:
    """Logarithms of the scale along x and along y at the centre of the picture, shape (2,)."""
    to_board = np.asarray(np.linalg.inv(to_picture), dtype=np.float64)
    steps = MIDDLE_PX * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    seen = apply_homography(to_board, middle + steps)
    return -np.log([float(np.linalg.norm(seen[0] - seen[1])), float(np.linalg.norm(seen[2] - seen[3]))])


def _gradient(quantity: Callable[[Floats], Floats], points: Floats) -> Floats:
    """Derivative of a quantity of shape (k,) by the positions of all corners; shape (n, 2, k)."""
    changes = []
    for index in np.ndindex(*points.shape):
        moved = points.copy()
        moved[index] += STEP_PX
        other = points.copy()
        other[index] -= STEP_PX
        changes.append((quantity(moved) - quantity(other)) / (2.0 * STEP_PX))
    return np.array(changes).reshape(*points.shape, -1)

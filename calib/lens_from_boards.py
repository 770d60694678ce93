"""Lens distortion from several pictures of a board."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.board import BoardCorners
from calib.errors import CalibrationError
from calib.lens import Lens

Floats = NDArray[np.float64]

# Numbers of columns of OpenCV's Jacobian for the pose (3 rotation, 3 translation) and for the lens (2 focal lengths, 2
# coordinates of the centre, k1, k2, p1, p2, k3).
POSE, LENS = 6, 9
# Reduction of chi-square above which k3 is fitted (one parameter, significance level of 0.1 %).
WORTH_A_PARAMETER = 10.8


@dataclass(frozen=True, slots=True, eq=False)
class LensFit:
    """A fitted lens, with the residuals of the fit (px).

    Parameters
    ----------
    lens : Lens
        The distortion, with its covariance.
    u_parameters : ndarray, shape (9,)
        Standard deviations of the parameters by OpenCV's extended calibration, for comparison with other tools.
    rms_px : float
        Root mean square of the distances between measured and predicted corners (OpenCV's reprojection error).
    residual_px : tuple of ndarray, each of shape (n, 2)
        Measured minus predicted positions of the corners, picture by picture.
    """

    lens: Lens
    u_parameters: Floats
    rms_px: float
    residual_px: tuple[Floats, ...]


def lens_from_boards(pictures: Sequence[BoardCorners], frame_size_px: tuple[int, int]) -> LensFit:
    """Fit camera and distortion to all corners (Zhang, IEEE PAMI 22(11), 2000, 1330-1334).

    Parameters
    ----------
    pictures : sequence of BoardCorners
        At least three pictures of boards at different tilts.
    frame_size_px : tuple of int
        Width and height of the pictures.
    """
    if len(pictures) < 3:
        raise CalibrationError(
            f"A lens needs at least three pictures of the board at different tilts, but there are {len(pictures)}: "
            "take more pictures, or give a single picture to calibrate only the plane."
        )
    board = [np.column_stack([each.board_mm, np.zeros(len(each.board_mm))]).astype(np.float32) for each in pictures]
    seen = [each.points_px.astype(np.float32).reshape(-1, 1, 2) for each in pictures]
    fits = []
    for flags in (cv2.CALIB_FIX_K3, 0):
        fit = cv2.calibrateCameraExtended(board, seen, frame_size_px, np.eye(3), np.zeros(5), flags=flags)
        fits.append(fit)
    count = 2 * sum(len(each.points_px) for each in pictures)
    without, with_k3 = (float(fit[0]) ** 2 * count / 2.0 for fit in fits)
    variance = with_k3 / max(count - LENS - POSE * len(pictures), 1)
    fit = fits[int(without - with_k3 > WORTH_A_PARAMETER * variance)]
    matrix, coefficients, u_lens = (np.asarray(fit[k], dtype=np.float64) for k in (1, 2, 5))
    rotations, translations = (np.array(fit[k], dtype=np.float64).reshape(-1, 3) for k in (3, 4))
    parameters = np.concatenate([[matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]], coefficients.ravel()[:5]])
    if not (np.all(np.isfinite(parameters)) and min(parameters[:2]) > 0.0):
        raise CalibrationError("The pictures do not define a lens: tilt the board differently in each of them.")
    covariance, residual = _covariance(pictures, board, matrix, coefficients, rotations, translations)
    if parameters[8] == 0.0:
        covariance[8], covariance[:, 8] = 0.0, 0.0
    return LensFit(Lens(parameters, covariance), u_lens.ravel()[:LENS], float(fit[0]), residual)


def _covariance(
    pictures: Sequence[BoardCorners],
    board: Sequence[NDArray[np.float32]],
    matrix: Floats,
    coefficients: Floats,
    rotations: Floats,
    translations: Floats,
) -> tuple[Floats, tuple[Floats, ...]]:
    """Covariance of the lens parameters with all poses free, because OpenCV returns only standard deviations."""
    normal, count, squares = np.zeros((LENS, LENS)), 0, 0.0
    residuals = []
    held = coefficients.ravel()[4] == 0.0
    for each, points, rotation, translation in zip(pictures, board, rotations, translations, strict=True):
        predicted, jacobian = cv2.projectPoints(points.astype(np.float64), rotation, translation, matrix, coefficients)
        of_pose, of_lens = jacobian[:, :POSE], jacobian[:, POSE : POSE + LENS].copy()
        if held:
            of_lens[:, 8] = 0.0
        # The pose of every picture is free, so that changes which a pose can reproduce are removed (Schur complement).
        free = of_lens - of_pose @ np.linalg.lstsq(of_pose, of_lens, rcond=None)[0]
        normal += free.T @ free
        left = each.points_px - np.asarray(predicted).reshape(-1, 2)
        residuals.append(left)
        squares += float(np.sum(left**2))
        count += left.size
    variance = squares / max(count - LENS - POSE * len(pictures), 1)
    unit = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    scaled = normal / np.outer(unit, unit)
    inverse = np.asarray(np.linalg.pinv(scaled, rcond=1e-12, hermitian=True), dtype=np.float64)
    return variance * inverse / np.outer(unit, unit), tuple(residuals)


def straightness_px(corners: BoardCorners, lens: Lens | None) -> Floats:
    """Distances of the corners from straight lines through the board's rows and columns, corrected for the lens.

    Returns
    -------
    ndarray, shape (n,)
        Distances in pixels; each corner is counted once for its row and once for its column; lines with fewer than
        three corners are left out.
    """
    points = corners.points_px if lens is None else lens.undistort(corners.points_px)
    away = []
    for axis in (0, 1):
        for number in np.unique(corners.cells[:, axis]):
            line = points[corners.cells[:, axis] == number]
            if len(line) >= 3:
                centred = line - line.mean(axis=0)
                across = np.linalg.svd(centred, full_matrices=False)[2][1]
                away.append(centred @ across)
    return np.concatenate(away) if away else np.zeros(0)

"""Scale, lens and plane from pictures of a board whose corners have certified positions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.board import Board, BoardCorners
from calib.errors import CalibrationError
from calib.limits import Limits, rectangular
from calib.measured_scale import Calibration, Reference, Response, ScalePart
from calib.picture_shift import centre_px, lens_shift_px
from calib.projection import Lens, Plane, apply_homography
from calib.short_repr import ShortRepr

Floats = NDArray[np.float64]

# Half length (pixels) of the short distance at the picture's centre from which the scale is computed.
MIDDLE_PX = 1.0
# Step of numerical derivatives by a corner's position (pixels).
STEP_PX = 0.01
# Step of numerical derivatives by the distortion at the picture's corner.
STEP_LENS = 1e-3


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PlaneFit(ShortRepr):
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


# Numbers of columns of OpenCV's Jacobian for the pose (3 rotation, 3 translation) and for the lens (2 focal lengths, 2
# coordinates of the centre, k1, k2, p1, p2, k3).
POSE, LENS = 6, 9
# Reduction of chi-square above which k3 is fitted (one parameter, significance level of 0.1 %).
WORTH_A_PARAMETER = 10.8


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LensFit(ShortRepr):
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BoardFit(ShortRepr):
    """The calibration, with the residuals of its fit.

    Parameters
    ----------
    calibration : Calibration
        The result.
    lens : LensFit or None
        Lens fit; None for one picture, which determines the plane only.
    plane : PlaneFit
        Plane of the first picture.
    straightness_px : float
        Root-mean-square distance of all corners from straight rows and columns, corrected for the lens.
    """

    calibration: Calibration
    lens: LensFit | None
    plane: PlaneFit
    straightness_px: float


def scale_from_board(
    pictures: Sequence[BoardCorners],
    board: Board,
    frame_size_px: tuple[int, int],
    limits: Limits,
    stated: frozenset[str] = frozenset(),
) -> BoardFit:
    """Calibrate on a board; distances are measured in the plane of the board in the first picture.

    Parameters
    ----------
    pictures : sequence of BoardCorners
        One picture for the plane; three or more, at different tilts, for the lens as well.
    board : Board
        The board in the pictures.
    frame_size_px : tuple of int
        Width and height.
    limits, stated
        Limits of the set-up's imperfections, and the names of those that the user stated.

    Examples
    --------
    The corners of an undistorted picture in which 1 mm is 20 pixels:

    >>> import numpy as np, calib
    >>> board = calib.Board(9, 6, square_mm=2.0, u_square_mm=0.002)
    >>> cells = np.array([(column, row) for row in range(6) for column in range(9)])
    >>> corners = calib.BoardCorners("board.png", 40.0 * cells + 60.0, cells, 2.0 * cells)
    >>> fit = calib.scale_from_board([corners], board, (440, 320), calib.Limits(tilt_deg=0.5))
    >>> print(f"{fit.calibration.px_per_mm:.2f} px/mm")
    20.00 px/mm

    With three pictures or more, `fit.lens.lens` is the `calib.Lens`; the `calib.Plane` is `fit.plane.plane`.
    """
    if not pictures:
        raise CalibrationError("A calibration needs at least one picture of the board, but there is none.")
    lens = lens_from_boards(pictures, frame_size_px) if len(pictures) > 1 else None
    first = pictures[0]
    ideal_px = first.points_px if lens is None else lens.lens.undistort(first.points_px)
    plane = plane_from_board(first, ideal_px, frame_size_px)
    relative = board.u_square_mm / board.square_mm
    parts = (
        _part("reference size", plane.px_per_mm * relative, 0.0, "the certificate (--u-square-mm)"),
        _part("reference edges", plane.u_px_per_mm, 0.0, "the fit of the first picture's corners"),
        _part(
            "edge bias",
            0.0,
            rectangular(limits.edge_bias_px),
            f"+-{limits.edge_bias_px:g} px ({'stated' if 'edge_bias_px' in stated else 'default'}); corners do not "
            "determine the edge bias",
        ),
    )
    kind = "chessboard" if board.marker_mm is None else "ChArUco board"
    calibration = Calibration(
        px_per_mm=plane.px_per_mm,
        edge_bias_px=0.0,
        parts=parts,
        frame_size_px=frame_size_px,
        limits=limits,
        stated=stated,
        response=Response(lens=np.array([plane.by_lens, 0.0])),
        lens=None if lens is None else lens.lens,
        plane=plane.plane,
        references=tuple(
            Reference(f"{kind} {board.columns}x{board.rows}, {each.name}", board.square_mm, board.u_square_mm)
            for each in pictures
        ),
    )
    away = np.concatenate([straightness_px(each, calibration.lens) for each in pictures])
    return BoardFit(calibration, lens, plane, float(np.sqrt(np.mean(away**2))) if away.size else 0.0)


def _part(source: str, u_scale: float, u_bias: float, supplied: str) -> ScalePart:
    return ScalePart(source, np.diag([u_scale**2, u_bias**2]), supplied)

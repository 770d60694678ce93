"""Chessboards and ChArUco boards: sub-pixel positions of the corners of their squares."""

from dataclasses import dataclass
from math import isfinite

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError
from calib.short_repr import ShortRepr

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

# Half width of the window in which a corner is refined, as a share of the distance to the nearest corner: the largest
# window that contains no edges of other squares.
WINDOW_PART = 0.3
# Half width of this window on a ChArUco board, as a share of the margin between the corner of a square and its marker,
# which must lie outside the window.
MARKER_MARGIN_PART = 0.8
REFINED_PX, REFINING_STEPS = 1e-4, 100
# Largest deviation of the corners from a plane in perspective, as a share of the board's extent; it allows for the
# distortion of an ordinary lens.
ONE_BOARD = 0.05
FEWEST_CORNERS = 6
# The largest dictionary of each family; smaller dictionaries of a family contain the same markers with the same
# numbers.
DICTIONARIES = (
    "DICT_4X4_1000",
    "DICT_5X5_1000",
    "DICT_6X6_1000",
    "DICT_7X7_1000",
    "DICT_ARUCO_ORIGINAL",
    "DICT_APRILTAG_16h5",
    "DICT_APRILTAG_25h9",
    "DICT_APRILTAG_36h10",
    "DICT_APRILTAG_36h11",
)


@dataclass(frozen=True, slots=True)
class Board:
    """A flat calibration board with a pattern of squares.

    Parameters
    ----------
    columns, rows : int
        Number of inner corners of a chessboard, or of squares of a ChArUco board, as in OpenCV.
    square_mm, u_square_mm : float
        Side of a square, and the standard uncertainty of the board's scale, expressed for one square.
    marker_mm : float or None
        Side of a marker on a ChArUco board; None for a chessboard.
    """

    columns: int
    rows: int
    square_mm: float
    u_square_mm: float
    marker_mm: float | None = None

    def __post_init__(self) -> None:
        """Refuse an impossible board."""
        if min(self.columns, self.rows) < 3:
            raise CalibrationError(f"A board must have at least 3x3 corners, but {self.columns}x{self.rows} is stated.")
        if not (isfinite(self.square_mm) and self.square_mm > 0.0):
            raise CalibrationError(f"A square's side must be positive, but is {self.square_mm} mm.")
        if not (isfinite(self.u_square_mm) and self.u_square_mm >= 0.0):
            raise CalibrationError(
                f"The uncertainty of a square's side must be zero or more, but is {self.u_square_mm} mm."
            )
        if self.marker_mm is not None and not 0.0 < self.marker_mm < self.square_mm:
            raise CalibrationError(
                f"A marker must be smaller than its square of {self.square_mm} mm, but is {self.marker_mm} mm."
            )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BoardCorners(ShortRepr):
    """The corners visible in one picture.

    Parameters
    ----------
    name : str
        The picture's name.
    points_px : ndarray, shape (n, 2)
        Positions of the corners in the picture.
    cells : ndarray of int, shape (n, 2)
        Column and row of each corner on the board.
    board_mm : ndarray, shape (n, 2)
        Positions of the corners on the board.
    """

    name: str
    points_px: Floats
    cells: Ints
    board_mm: Floats


def find_corners(grey: Grey, board: Board, name: str) -> BoardCorners:
    """Find the board's corners in a picture.

    Raises
    ------
    CalibrationError
        If the picture does not show this board.

    Examples
    --------
    A chessboard of 10 x 7 squares that was drawn:

    >>> import numpy as np, calib
    >>> grey = np.full((320, 440), 230, np.uint8)
    >>> for row, column in np.ndindex(7, 10):
    ...     if (row + column) % 2 == 0:
    ...         grey[20 + 40 * row : 60 + 40 * row, 20 + 40 * column : 60 + 40 * column] = 40
    >>> board = calib.Board(9, 6, square_mm=2.0, u_square_mm=0.002)
    >>> corners = calib.find_corners(grey, board, "board.png")
    >>> corners.points_px.shape
    (54, 2)
    """
    eight_bit = np.asarray(grey if grey.dtype == np.uint8 else grey // 257, dtype=np.uint8)
    found = _chessboard(eight_bit, board) if board.marker_mm is None else _charuco(eight_bit, board)
    if found is None:
        if board.marker_mm is None:
            raise CalibrationError(
                f"{name} must show a complete chessboard of {board.columns}x{board.rows} inner corners, but does not: "
                f"check --squares, which states the number of inner corners (here of {board.columns + 1}x"
                f"{board.rows + 1} squares), and that the board has a light margin."
            )
        raise CalibrationError(
            f"{name} must show a ChArUco board of {board.columns}x{board.rows} squares, but does not: check --squares "
            "and that at least six corners between markers are in view."
        )
    points_px, cells = found
    return BoardCorners(name, points_px, cells, np.asarray(cells * board.square_mm, dtype=np.float64))


def _chessboard(grey: NDArray[np.uint8], board: Board) -> tuple[Floats, Ints] | None:
    size = (board.columns, board.rows)
    seen, corners = cv2.findChessboardCorners(grey, size)
    if not seen:
        # The second algorithm also finds boards in blurred or noisy pictures, but is slower.
        seen, corners = cv2.findChessboardCornersSB(grey, size, None, cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not seen:
        return None
    cells = np.mgrid[: board.columns, : board.rows].T.reshape(-1, 2)
    coarse = np.asarray(corners, dtype=np.float32).reshape(-1, 2)
    return _refined(grey, coarse, WINDOW_PART * _spacing_px(coarse)), cells


def _charuco(grey: NDArray[np.uint8], board: Board) -> tuple[Floats, Ints] | None:
    """Corners of a ChArUco board; the marker dictionary is found from the picture."""
    assert board.marker_mm is not None  # noqa: S101 - the caller asks only for boards with markers
    best: tuple[Floats, Ints] | None = None
    for name in DICTIONARIES:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        found = cv2.aruco.ArucoDetector(dictionary).detectMarkers(grey)[0]
        if len(found) < 3:
            continue
        for legacy in (False, True):
            pattern = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_mm, board.marker_mm, dictionary)
            pattern.setLegacyPattern(legacy)
            corners, ids, _, _ = cv2.aruco.CharucoDetector(pattern).detectBoard(grey)
            number = np.asarray(ids if np.ndim(ids) else [], dtype=np.int_).reshape(-1)
            if number.size < FEWEST_CORNERS:
                continue
            cells = np.stack([number % (board.columns - 1), number // (board.columns - 1)], axis=1)
            coarse = np.asarray(corners, dtype=np.float32).reshape(-1, 2)
            if _is_one_board(coarse, cells) and (best is None or len(cells) > len(best[1])):
                margin = MARKER_MARGIN_PART * (1.0 - board.marker_mm / board.square_mm) / 2.0
                spacing_px = _spacing_px(coarse)
                best = _refined(grey, coarse, min(WINDOW_PART, margin) * spacing_px), cells
        if best is not None:
            return best
    return None


def _is_one_board(points_px: NDArray[np.float32], cells: Ints) -> bool:
    if np.ptp(cells[:, 0]) == 0 or np.ptp(cells[:, 1]) == 0:
        return False
    homography, _ = cv2.findHomography(cells.astype(np.float64), points_px.astype(np.float64))
    if homography is None:
        return False
    seen = cv2.perspectiveTransform(cells.astype(np.float64)[None], homography)[0]
    worst = float(np.max(np.linalg.norm(seen - points_px, axis=1)))
    return worst < ONE_BOARD * float(np.ptp(points_px, axis=0).max())


def _spacing_px(points_px: NDArray[np.float32]) -> float:
    apart = np.linalg.norm(points_px[:, None] - points_px[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return float(apart.min())


def _refined(grey: NDArray[np.uint8], coarse: NDArray[np.float32], reach_px: float) -> Floats:
    # The corner is the point for which all gradients are perpendicular to the lines from the corner (Foerstner &
    # Guelch, ISPRS 1987).
    reach = max(2, round(reach_px))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, REFINING_STEPS, REFINED_PX)
    corners = cv2.cornerSubPix(grey, coarse.reshape(-1, 1, 2).copy(), (reach, reach), (-1, -1), criteria)
    return np.asarray(corners, dtype=np.float64).reshape(-1, 2)

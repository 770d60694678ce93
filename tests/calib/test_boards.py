"""Calibration boards, rendered and photographed: lens, plane and scale; other boards are refused."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from calib.board import Board, find_corners
from calib.errors import CalibrationError
from calib.limits import Limits
from calib.projection import Lens
from calib.scale_from_board import scale_from_board
from fingervision.rendering.camera import Camera, RadialLens, Tilt
from fingervision.rendering.picture import render
from fingervision.rendering.scene import Light, Patch, Scene
from fingervision.rendering.targets import chessboard

REAL = Path(__file__).parents[3] / "shared" / "real" / "chessboard"
PHOTOGRAPHS = sorted(REAL.glob("*.jpg"))
BOARD = Board(9, 6, 1.0, 0.0005)
FRAME = (640, 480)
SQUARE_PX = 45.0
# Corners of a rendered board with little noise are good to a few hundredths of a pixel; over 400 px that is 1e-4.
SCALE_PART = 3e-4


def rendered(
    tilt: tuple[float, float] = (0.0, 0.0), k1: float = 0.0, turn_deg: float = 2.0, seed: int = 1
) -> NDArray[np.uint8]:
    squares = chessboard((9, 6), SQUARE_PX, x_px=325.0, y_px=236.0, turn_deg=turn_deg)
    camera = Camera(noise_grey=1.0, lens=RadialLens(k1=k1), tilt=Tilt(tilt[0], tilt[1], distance_px=2500.0))
    scene = Scene(light=Light(ground=200.0), behind=(Patch(squares, 40.0),))
    return render(scene, camera, np.random.default_rng(seed))


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.0, 12.0), (8.0, -10.0)])
def test_one_picture_gives_the_plane(tilt: tuple[float, float]) -> None:
    """Distances across the whole board are correct for any tilt of the plane."""
    corners = find_corners(rendered(tilt), BOARD, "board.png")
    fit = scale_from_board([corners], BOARD, FRAME, Limits())
    assert fit.lens is None
    grid = corners.points_px.reshape(6, 9, 2)
    pairs = np.stack([grid[:, :-1].reshape(-1, 2), grid[:, 1:].reshape(-1, 2)], axis=1)
    got = fit.calibration.distances(pairs, np.zeros(len(pairs)), np.ones(len(pairs), dtype=bool))
    assert got.value_mm == pytest.approx(np.ones(len(pairs)), abs=0.003)
    assert fit.plane.tilt_deg == pytest.approx(np.hypot(*tilt), abs=1.5)


def test_the_scale_of_a_squarely_seen_board_is_the_drawn_one() -> None:
    fit = scale_from_board([find_corners(rendered(), BOARD, "board.png")], BOARD, FRAME, Limits())
    scale = fit.calibration.px_per_mm
    assert scale == pytest.approx(SQUARE_PX, rel=SCALE_PART)
    assert abs(scale - SQUARE_PX) < 3.0 * fit.calibration.u_px_per_mm
    # The middle of the picture stays where it is, and the picture is not turned.
    middle = np.array([[319.5, 239.5], [329.5, 239.5]])
    assert fit.calibration.flatten(middle) == pytest.approx(middle, abs=0.02)


def test_a_lens_is_taken_off_measured_points() -> None:
    k1 = -0.05
    views = [(0.0, 0.0), (25.0, 0.0), (0.0, 25.0), (-20.0, 15.0), (15.0, -22.0)]
    corners = [find_corners(rendered(tilt, k1, seed=seed), BOARD, f"{seed}") for seed, tilt in enumerate(views)]
    fit = scale_from_board(corners, BOARD, FRAME, Limits())
    bare = scale_from_board(corners[:1], BOARD, FRAME, Limits())
    assert fit.lens is not None
    assert fit.lens.rms_px < 0.05
    assert fit.straightness_px < 0.05
    assert bare.straightness_px > 5 * fit.straightness_px
    assert fit.calibration.px_per_mm == pytest.approx(SQUARE_PX, rel=3 * SCALE_PART)


def test_undistorting_is_the_inverse_of_distorting() -> None:
    lens = Lens(np.array([800.0, 810.0, 320.0, 238.0, -0.28, 0.1, 1e-3, -1e-3, 0.02]), np.zeros((9, 9)))
    ideal = np.stack(np.meshgrid(np.linspace(20, 620, 7), np.linspace(20, 460, 5)), axis=-1).reshape(-1, 2)
    rays = np.column_stack([(ideal - [320.0, 238.0]) / [800.0, 810.0], np.ones(len(ideal))])
    seen = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), lens.camera_matrix, lens.parameters[4:])[0].reshape(-1, 2)
    assert lens.undistort(seen) == pytest.approx(ideal, abs=1e-7)


def test_charuco_corners_are_those_of_the_drawn_board() -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    drawn = cv2.aruco.CharucoBoard((8, 6), 3.0, 2.2, dictionary).generateImage((560, 420), None, 0, 1)
    # A square is 70 px; the picture of the board is moved and partly cut off by the frame.
    moved = cv2.warpAffine(drawn, np.array([[1.0, 0.0, -90.0], [0.0, 1.0, 30.0]]), FRAME, borderValue=255)
    board = Board(8, 6, 3.0, 0.001, marker_mm=2.2)
    corners = find_corners(cv2.GaussianBlur(moved, (0, 0), 0.8), board, "charuco.png")
    fit = scale_from_board([corners], board, FRAME, Limits())
    assert len(corners.cells) < 35
    assert fit.calibration.px_per_mm == pytest.approx(70.0 / 3.0, rel=1e-3)
    with pytest.raises(CalibrationError, match="must show a ChArUco board of 7x5 squares, but does not"):
        find_corners(moved, Board(7, 5, 3.0, 0.001, marker_mm=2.2), "charuco.png")


@pytest.mark.parametrize("size", [(8, 6), (9, 5), (10, 7)])
def test_another_chessboard_is_refused(size: tuple[int, int]) -> None:
    words = f"board.png must show a complete chessboard of {size[0]}x{size[1]} inner corners, .* check --squares"
    with pytest.raises(CalibrationError, match=words):
        find_corners(rendered(), Board(*size, 1.0, 0.001), "board.png")


def test_two_pictures_are_no_lens() -> None:
    corners = find_corners(rendered(), BOARD, "board.png")
    with pytest.raises(
        CalibrationError, match="at least three pictures of the board at different tilts, but there are 2"
    ):
        scale_from_board([corners, corners], BOARD, FRAME, Limits())


@pytest.mark.parametrize(
    ("board", "sentence"),
    [
        ((2, 6, 1.0, 0.0), "at least 3x3 corners, but 2x6"),
        ((9, 6, 0.0, 0.0), "side must be positive, but is 0.0"),
        ((9, 6, 1.0, -1.0), "zero or more, but is -1.0"),
        ((9, 6, 1.0, 0.0, 1.5), "smaller than its square of 1.0 mm, but is 1.5"),
    ],
)
def test_what_is_no_board(board: tuple[int, int, float, float], sentence: str) -> None:
    with pytest.raises(CalibrationError, match=sentence):
        Board(*board)


@pytest.mark.skipif(not PHOTOGRAPHS, reason="the photographs of a chessboard are not here (../shared/real)")
def test_photographs() -> None:
    board = Board(9, 6, 25.0, 0.025)
    corners = [find_corners(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), board, path.name) for path in PHOTOGRAPHS]
    fit = scale_from_board(corners, board, FRAME, Limits())
    assert fit.lens is not None
    # The bars of the issue.
    assert fit.lens.rms_px < 0.21
    assert fit.straightness_px < 0.12
    # Our covariance of the lens gives the standard deviations of OpenCV's extended calibration.
    assert np.sqrt(np.diag(fit.lens.lens.covariance)) == pytest.approx(fit.lens.u_parameters, rel=0.01)

"""Calibration objects have the stated sizes, and other programs measure these sizes."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingervision.rendering.camera import IDEAL_CAMERA, Camera
from fingervision.rendering.picture import exact_grey, render
from fingervision.rendering.scene import Patch, Scene
from fingervision.rendering.targets import bar, chessboard, slot

# The required accuracy of an edge.
EDGE_PX = 1e-3
# What OpenCV's corner refinement reaches on a clean board.
CORNER_PX = 0.05


@settings(deadline=None)
@given(size_px=st.floats(1.0, 600.0), turn_deg=st.floats(-90.0, 90.0))
def test_a_bar_has_its_size_square_to_its_sides(size_px: float, turn_deg: float) -> None:
    (outline,) = bar(size_px, 700.0, x_px=320.0, y_px=240.0, turn_deg=turn_deg)
    assert outline.area_px2 / 700.0 == pytest.approx(size_px)
    assert sorted(piece.length_px for piece in outline.pieces)[0] == pytest.approx(min(size_px, 700.0))


def test_an_upright_bar_and_a_slot_are_drawn_with_their_size() -> None:
    dark = exact_grey(Scene(behind=(Patch(bar(170.3, 800.0, x_px=318.7, y_px=239.0), 40.0),)), IDEAL_CAMERA)
    assert ((200.0 - dark[240]) / 160.0).sum() == pytest.approx(170.3, abs=EDGE_PX)
    light = exact_grey(Scene(behind=(Patch(slot(102.4, 340.0, x_px=320.2, y_px=239.0), 40.0),)), IDEAL_CAMERA)
    assert ((light[240] - 40.0) / 160.0).sum() == pytest.approx(102.4, abs=EDGE_PX)
    assert light[5, 5] == pytest.approx(40.0, abs=EDGE_PX)


def test_blooming_narrows_a_bar_and_widens_a_slot() -> None:
    camera = Camera(bloom_px=0.2)
    dark = exact_grey(Scene(behind=(Patch(bar(100.0, 800.0, x_px=320.0, y_px=239.0), 40.0),)), camera)
    light = exact_grey(Scene(behind=(Patch(slot(100.0, 340.0, x_px=320.0, y_px=239.0), 40.0),)), camera)
    assert ((200.0 - dark[240]) / 160.0).sum() == pytest.approx(99.6, abs=EDGE_PX)
    assert ((light[240] - 40.0) / 160.0).sum() == pytest.approx(100.4, abs=EDGE_PX)


@pytest.mark.parametrize("turn_deg", [0.0, 7.0])
def test_opencv_finds_the_corners_of_a_chessboard_where_they_are(turn_deg: float) -> None:
    board = chessboard((9, 6), 45.0, x_px=318.2, y_px=241.6, turn_deg=turn_deg)
    frame = render(Scene(behind=(Patch(board, 30.0),)), IDEAL_CAMERA, np.random.default_rng(0))
    found, corners = cv2.findChessboardCorners(frame, (9, 6))
    assert found
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
    refined = cv2.cornerSubPix(frame, corners, (6, 6), (-1, -1), criteria).reshape(-1, 2)
    x, y = np.meshgrid((np.arange(9) - 4) * 45.0, (np.arange(6) - 2.5) * 45.0)
    turn = np.radians(turn_deg)
    true = np.stack([318.2 + x * np.cos(turn) - y * np.sin(turn), 241.6 + x * np.sin(turn) + y * np.cos(turn)], axis=-1)
    distance = np.linalg.norm(refined[:, None] - true.reshape(-1, 2)[None], axis=-1).min(axis=1)
    assert distance.max() < CORNER_PX

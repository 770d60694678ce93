"""Pictures of calibration targets, rendered when an example is copied, to keep the installation small."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fingervision.domain.frame import Pixels

SIZE_PX = (640, 480)
PX_PER_MM = 20.0
SEED = 1
TILTS_DEG = ((0.0, 0.0), (0.0, 14.0), (12.0, -6.0), (-10.0, 8.0), (-8.0, -12.0))
"""Tilts of the boards about both axes, in degrees; the first board lies in the plane of measurement."""
CAMERA_DISTANCE_PX = 2500.0
EXPOSURES = {"e05.png": 0.5, "e10.png": 1.0, "e20.png": 2.0, "e40.png": 4.0}


def board_pictures(folder: Path) -> None:
    """Draw a chessboard of 9x6 inner corners and a ChArUco board of 8x6 squares, flat and tilted."""
    import cv2

    from fingervision.rendering import Camera, Light, Patch, Scene, Tilt, render
    from fingervision.rendering.targets import chessboard

    rng = np.random.default_rng(SEED)
    squares = chessboard((9, 6), 2.5 * PX_PER_MM, x_px=320.0, y_px=240.0, turn_deg=2.0)
    scene = Scene(light=Light(ground=200.0), behind=(Patch(squares, 40.0),))
    for number, (about_x, about_y) in enumerate(TILTS_DEG):
        camera = Camera(noise_grey=1.0, tilt=Tilt(about_x, about_y, distance_px=CAMERA_DISTANCE_PX))
        _write(folder / ("plane.png" if number == 0 else f"tilted{number}.png"), render(scene, camera, rng))
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    drawn = np.asarray(cv2.aruco.CharucoBoard((8, 6), 3.0, 2.2, dictionary).generateImage((512, 384), None, 0, 1))
    for number, (about_x, about_y) in enumerate(TILTS_DEG):
        seen = cv2.warpPerspective(drawn, _view(drawn.shape, about_x, about_y), SIZE_PX, borderValue=255)
        noisy = cv2.GaussianBlur(seen, (0, 0), 0.8) * 0.7 + 20.0 + rng.standard_normal(seen.shape)
        name = "charuco_plane.png" if number == 0 else f"charuco_tilted{number}.png"
        _write(folder / name, np.rint(noisy).astype(np.uint8))


def exposures(folder: Path) -> None:
    """Draw fields of many shades at four exposures, by a camera whose response is a power law of 1/2.2."""
    rng = np.random.default_rng(SEED)
    scene = np.kron(rng.uniform(0.005, 0.5, (16, 20)), np.ones((24, 24)))
    for name, exposure in EXPOSURES.items():
        light = np.clip(scene * exposure + 1e-3 * rng.standard_normal(scene.shape), 0.0, 1.0)
        _write(folder / name, np.rint(255.0 * light ** (1.0 / 2.2)).astype(np.uint8))


def step_wedge(folder: Path) -> None:
    """Draw a step wedge of 20 fields with densities from 0.05 to 1.95, by the camera of `exposures`."""
    rng = np.random.default_rng(SEED)
    light = np.full((480, 640), 0.5)
    light[200:260, 40:600] = np.repeat(10.0 ** -np.arange(0.05, 2.0, 0.1), 28)
    light = np.clip(0.9 * light + 1e-3 * rng.standard_normal(light.shape), 0.0, 1.0)
    _write(folder / "wedge.png", np.rint(255.0 * light ** (1.0 / 2.2)).astype(np.uint8))


def micrometer(folder: Path) -> None:
    """Draw a line scale of 0.1 mm pitch with 34 pixels from line to line, rotated by one degree in the picture."""
    import cv2

    rng = np.random.default_rng(SEED)
    samples, (width, height), pitch_px, width_px = 4, (640, 300), 34.0, 8.0
    x = (np.arange(width * samples) + 0.5) / samples - 0.5 - 0.5 * width
    y = (np.arange(height * samples) + 0.5) / samples - 0.5 - 0.5 * height
    turn = np.radians(1.0)
    across = np.cos(turn) * x[None, :] + np.sin(turn) * y[:, None]
    along = -np.sin(turn) * x[None, :] + np.cos(turn) * y[:, None]
    away = np.abs(across - pitch_px * np.round(across / pitch_px)) - 0.5 * width_px
    covered = np.clip(0.5 - samples * away, 0.0, 1.0) * (np.abs(along) < 70.0)
    light = cv2.GaussianBlur(0.7 - 0.64 * covered, (0, 0), 0.9 * samples)
    light = light.reshape(height, samples, width, samples).mean(axis=(1, 3))
    noisy = light + 1.5 / 255.0 * rng.standard_normal(light.shape)
    _write(folder / "micrometer.png", np.rint(255.0 * np.clip(noisy, 0.0, 1.0)).astype(np.uint8))


def _view(shape: tuple[int, ...], about_x_deg: float, about_y_deg: float) -> "NDArray[np.float64]":
    """Homography of a drawn board that is tilted and centred in the picture."""
    a, b = np.radians(about_x_deg), np.radians(about_y_deg)
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), -np.sin(a)], [0.0, np.sin(a), np.cos(a)]])
    turn_y = np.array([[np.cos(b), 0.0, np.sin(b)], [0.0, 1.0, 0.0], [-np.sin(b), 0.0, np.cos(b)]])
    centred = np.array([[1.0, 0.0, -0.5 * shape[1]], [0.0, 1.0, -0.5 * shape[0]], [0.0, 0.0, 1.0]])
    placed = (turn_x @ turn_y)[:, :2] @ centred[:2]
    placed[2] = placed[2] / CAMERA_DISTANCE_PX + centred[2]
    middle = np.array([[1.0, 0.0, 0.5 * SIZE_PX[0]], [0.0, 1.0, 0.5 * SIZE_PX[1]], [0.0, 0.0, 1.0]])
    return np.asarray(middle @ placed)


def _write(path: Path, picture: "Pixels") -> None:
    import cv2

    path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


__all__ = ["board_pictures", "exposures", "micrometer", "step_wedge"]

"""Line scales of known geometry: any direction, tone, width and response; pictures without a scale are refused."""

import cv2
import numpy as np
import pytest

from calib.errors import CalibrationError
from calib.limits import Limits
from calib.line_scale import find_lines
from calib.measured_scale import Reference
from calib.scale_from_lines import LineScaleFit, scale_from_lines

SIZE_PX = (320, 240)
REFERENCE = Reference("line scale drawn", 1.0, 0.0)
# The bar for scale; and what the fit of a line's middle owes (relative to the drawn pitch).
SCALE_RELATIVE = 1e-4


def drawn(
    pitch_px: float,
    width_px: float,
    turned_deg: float = 0.0,
    *,
    is_dark: bool = True,
    gamma: float = 1.0,
    moved: dict[int, float] | None = None,
) -> np.ndarray:
    rng = np.random.default_rng(4)
    samples, (width, height) = 4, SIZE_PX
    x = (np.arange(width * samples) + 0.5) / samples - 0.5 - 0.5 * width + rng.uniform(-0.5, 0.5)
    y = (np.arange(height * samples) + 0.5) / samples - 0.5 - 0.5 * height
    c, s = np.cos(np.radians(turned_deg)), np.sin(np.radians(turned_deg))
    across, along = c * x[None, :] + s * y[:, None], -s * x[None, :] + c * y[:, None]
    number = np.round(across / pitch_px)
    offset = np.zeros_like(number)
    for line, by in (moved or {}).items():
        offset[number == line] = by
    away = np.abs(across - number * pitch_px - offset) - 0.5 * width_px
    length = 60.0 + 25.0 * (number % 5 == 0)
    covered = np.clip(0.5 - samples * away, 0.0, 1.0) * (along > -50.0) * (along < length)
    ground, line = (0.7, 0.06) if is_dark else (0.06, 0.7)
    light = cv2.GaussianBlur(ground + covered * (line - ground), (0, 0), 0.9 * samples)
    light = light.reshape(height, samples, width, samples).mean(axis=(1, 3))
    light += 1.5 / 255.0 * rng.standard_normal(light.shape)
    return np.clip(np.rint(255.0 * np.clip(light, 0.0, 1.0) ** (1.0 / gamma)), 0, 255).astype(np.uint8)


def fitted(grey: np.ndarray, pitch_mm: float = 0.1, **limits: float) -> LineScaleFit:
    return scale_from_lines(find_lines(grey), pitch_mm, 0.0, 0.0, SIZE_PX, Limits(**limits), REFERENCE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pitch_px", "width_px", "turned_deg", "is_dark", "gamma"),
    [
        (34.0, 8.0, 1.3, True, 1.0),
        (34.0, 8.0, 88.5, True, 1.0),
        (25.0, 6.0, -20.0, True, 1.0),
        (34.0, 9.0, 0.4, False, 1.0),
        (34.0, 8.0, 0.0, True, 2.2),
        (13.3, 2.0, 2.0, True, 1.0),
    ],
)
def test_the_pitch_is_found(pitch_px: float, width_px: float, turned_deg: float, is_dark: bool, gamma: float) -> None:
    fit = fitted(drawn(pitch_px, width_px, turned_deg, is_dark=is_dark, gamma=gamma))
    scale = fit.calibration.px_per_mm
    assert scale == pytest.approx(10.0 * pitch_px, rel=SCALE_RELATIVE)
    assert abs(scale - 10.0 * pitch_px) < 3.0 * fit.calibration.u_px_per_mm
    assert all(edge == pytest.approx(scale, rel=10 * SCALE_RELATIVE) for edge in fit.by_edge)
    assert fit.used.all()
    if gamma == 1.0 and fit.width_mm is not None:
        assert fit.width_mm * scale == pytest.approx(width_px, abs=0.05)


@pytest.mark.slow
def test_response_narrows_the_lines_and_leaves_the_scale() -> None:
    linear, coded = (fitted(drawn(34.0, 8.0, gamma=gamma)) for gamma in (1.0, 2.2))
    assert linear.width_mm is not None
    assert coded.width_mm is not None
    assert coded.width_mm < 0.97 * linear.width_mm
    assert coded.calibration.px_per_mm == pytest.approx(linear.calibration.px_per_mm, rel=SCALE_RELATIVE)


@pytest.mark.slow
def test_a_line_off_its_place_is_left_out_and_a_bad_scale_is_said() -> None:
    fit = fitted(drawn(25.0, 6.0, moved={2: 3.0}))
    assert np.count_nonzero(~fit.used) == 1
    assert fit.calibration.px_per_mm == pytest.approx(250.0, rel=SCALE_RELATIVE)
    rough = fitted(drawn(25.0, 6.0, moved={-3: 0.12, -1: -0.12, 1: 0.12, 3: -0.12}))
    assert rough.probability < 0.01
    assert "misfit of the lines" in [part.source for part in rough.calibration.parts]
    assert rough.calibration.u_px_per_mm > fit.calibration.u_px_per_mm


def test_scale_and_bias_are_not_correlated() -> None:
    calibration = fitted(drawn(34.0, 8.0), edge_bias_px=0.3).calibration
    assert calibration.edge_bias_px == 0.0
    assert calibration.u_edge_bias_px == pytest.approx(0.3 / 3**0.5)
    assert calibration.covariance[0, 1] == 0.0


@pytest.mark.parametrize(
    ("grey", "words"),
    [
        (np.full((200, 200), 128, dtype=np.uint8), "lines"),
        (np.random.default_rng(1).integers(0, 256, (200, 200)).astype(np.uint8), "lines"),
        (drawn(150.0, 40.0), "complete lines"),
        (np.tile(np.array([0, 255, 255], dtype=np.uint8), (120, 60)), "apart"),
        (np.zeros((8, 8), dtype=np.uint8), "at least"),
    ],
)
def test_no_scale_is_a_sentence(grey: np.ndarray, words: str) -> None:
    with pytest.raises(CalibrationError, match=words):
        scale_from_lines(find_lines(grey), 0.1, 0.0, 0.0, SIZE_PX, Limits(), REFERENCE)


@pytest.mark.parametrize("pitch_mm", [0.0, -1.0, float("nan"), float("inf")])
def test_a_pitch_that_is_none(pitch_mm: float) -> None:
    with pytest.raises(CalibrationError, match="pitch"):
        scale_from_lines(find_lines(drawn(34.0, 8.0)), pitch_mm, 0.0, 0.0, SIZE_PX, Limits(), REFERENCE)


def test_a_region_outside() -> None:
    with pytest.raises(CalibrationError, match="region"):
        find_lines(drawn(34.0, 8.0), (0, 0, 999, 10))

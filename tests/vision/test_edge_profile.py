"""A bright rim or clipping displaces an edge: the effect is stated in the uncertainty, refused, or absent."""

import numpy as np
import pytest

from calib.camera_response import standard_response
from fingervision.domain.camera import stated_camera
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.rendering import Camera, Light, Rim, TrueGap, render, truth, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame

# A bound on what may have moved the edges is taken for a standard uncertainty.
SIGMAS = 2.0
POSITIONS = 3


def _measured(number: int, camera: Camera, **options: object) -> tuple[GapMeasurement | NoGap, float]:
    """Picture with one of several sub-pixel positions, and its true gap."""
    places = {"gap_px": 141.3 + 0.37 * number, "tip_at_px": 120.4 + 0.13 * number, "radius_px": 30.0}
    scene = two_fingers(**{**places, **options})  # type: ignore[arg-type]
    true = truth(scene, camera, 10.2)
    assert isinstance(true, TrueGap)
    pixels = render(scene, camera, np.random.default_rng([96, number]))
    return measure_frame(Frame(pixels, number), Settings(10.2, Direction.UP)), true.gap_px


@pytest.mark.parametrize("exposure", [1.0, 1.03, 1.06, 1.2, 1.5])
@pytest.mark.parametrize("blur_px", [0.7, 0.9, 1.5, 2.5])
def test_light_beyond_the_scale_is_refused_or_stated(exposure: float, blur_px: float) -> None:
    refused = 0
    for number in range(POSITIONS):
        light = Light(ground=200.0, exposure=exposure * 255.0 / 200.0)
        found, true_px = _measured(number, Camera(blur_px=blur_px, noise_grey=2.0), light=light)
        if isinstance(found, NoGap):
            assert found.status is Status.SATURATED
            refused += 1
        else:
            assert abs(found.gap_px - true_px) < SIGMAS * np.hypot(found.u_gap_px, found.u_shift_px)
    # Light that just fills the scale is the normal set-up; a fifth beyond it is cut off.
    assert refused == 0 if exposure <= 1.0 else refused > 0 if exposure >= 1.2 else True


@pytest.mark.parametrize("width_px", [1.5, 2.5, 4.0])
@pytest.mark.parametrize("level", [200.0, 235.0])
def test_a_rim_is_stated(width_px: float, level: float) -> None:
    for number in range(POSITIONS):
        camera = Camera(blur_px=0.9, noise_grey=2.0)
        found, true_px = _measured(number, camera, light=Light(ground=170.0), rim=Rim(width_px, level))
        assert isinstance(found, GapMeasurement)
        assert found.u_shift_px > 0
        assert abs(found.gap_px - true_px) < SIGMAS * np.hypot(found.u_gap_px, found.u_shift_px)


@pytest.mark.parametrize("options", [{}, {"tilt_deg": (6.0, -4.0)}, {"radius_px": 0.0}, {"light": Light(slope_x=0.4)}])
@pytest.mark.parametrize("blur_px", [0.7, 1.5, 3.0])
def test_clean_edges_show_neither(options: dict, blur_px: float) -> None:
    for number in range(POSITIONS):
        found, _ = _measured(number, Camera(blur_px=blur_px, noise_grey=2.0), **options)
        assert isinstance(found, GapMeasurement)
        assert found.u_shift_px == 0.0


@pytest.mark.parametrize("exposure", [1.0, 1.5])
def test_white_of_studio_range_is_cut_off(exposure: float) -> None:
    """A video of limited range is clipped at level 235: overexposure is refused as it is at full scale."""
    light = Light(ground=200.0, exposure=exposure * 255.0 / 200.0)
    scene = two_fingers(gap_px=141.3, tip_at_px=120.4, radius_px=30.0, light=light)
    pixels = render(scene, Camera(blur_px=1.5, noise_grey=2.0), np.random.default_rng(96)) / 255.0
    signal = np.where(pixels < 0.018, 4.5 * pixels, 1.0993 * pixels**0.45 - 0.0993)
    stored = np.rint(16.0 + 219.0 * signal).astype(np.uint8)
    response = standard_response("bt709_studio")
    found = measure_frame(Frame(stored, 0), Settings(10.2, Direction.UP, camera=stated_camera(response)))
    assert found.status is (Status.OK if exposure == 1.0 else Status.SATURATED)
    # A camera that uses the levels above white is not cut off there.
    above = np.minimum(stored, 225) + np.random.default_rng(97).integers(0, 30, stored.shape).astype(np.uint8)
    assert response.cut_off_at(above, 255) == 255
    assert standard_response("bt709").cut_off_at(stored, 255) == 255
    # For calibrations, too, what is cut off is the end of the scale.
    assert response.linearised(stored, 255).max() == 65535

"""Pictures of a camera with gamma, drawn by the third renderer: known or assumed response, several bit depths."""

import numpy as np
import pytest

from calib.camera_response import CameraResponse, standard_response
from fingervision.domain.camera import stated_camera
from fingervision.domain.direction import Direction
from fingervision.domain.errors import DataError
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.status import Status
from fingervision.vision.grey import top_level
from fingervision.vision.pipeline import Settings, measure_frame
from fingervision.vision.response_shift import edge_shift_px
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, gamma, plain
from tests.benchmarks.camera_artefacts.optics import Surface

SHARE = np.linspace(0.0, 1.0, 256)
POWER = CameraResponse("power of 2.2", SHARE, SHARE**2.2)
# The bar of the issue for linearised pictures, and the coverage of 2 u.
RMS_PX, SIGMAS = 0.03, 4.0


def measured(picture: np.ndarray, settings: Settings) -> GapMeasurement:
    found = measure_frame(Frame(picture, 0), settings)
    assert isinstance(found, GapMeasurement), found
    return found


@pytest.mark.slow
@pytest.mark.parametrize("blur_px", [0.9, 2.0])
def test_a_known_response_takes_the_bias_away(blur_px: float) -> None:
    rng = np.random.default_rng([15, int(10 * blur_px)])
    known = Settings(BELOW_PX, Direction.UP, camera=stated_camera(POWER))
    errors = []
    for _ in range(6):
        shot = gamma(rng, blur_px)
        found = measured(shot.picture, known)
        assert found.u_picture_px == 0.0
        assert abs(found.gap_px - shot.gap_px) < SIGMAS * found.u_gap_px
        errors.append(found.gap_px - shot.gap_px)
        assumed = measured(shot.picture, Settings(BELOW_PX, Direction.UP))
        # Taken as linear the gap is wrong by half a pixel and more; what is stated holds it, and has its sign.
        assert abs(assumed.gap_px - shot.gap_px) > 0.2
        assert abs(assumed.gap_px - shot.gap_px) < 2.0 * np.hypot(assumed.u_gap_px, assumed.u_picture_px)
        assert np.sqrt(3.0) * assumed.u_response_px == pytest.approx(assumed.gap_px - shot.gap_px, rel=0.25, abs=0.1)
    assert np.sqrt(np.mean(np.square(errors))) < RMS_PX


def test_the_shift_is_odd_and_grows_with_blur() -> None:
    linear, srgb = standard_response("linear"), standard_response("srgb")
    there = edge_shift_px(linear, srgb, 0.2, 0.8, 1.0)
    assert edge_shift_px(linear, srgb, 0.8, 0.2, 1.0) == pytest.approx(-there, abs=0.01)
    assert abs(edge_shift_px(linear, srgb, 0.2, 0.8, 2.0)) > 1.5 * abs(there)
    assert edge_shift_px(linear, linear, 0.2, 0.8, 1.0) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("bits", "shift"), [(10, 0), (12, 0), (12, 4), (14, 0), (16, 0)])
def test_depths_stored_in_sixteen_bits(bits: int, shift: int) -> None:
    """A picture gives the same measurement at any bit depth, and clipping is detected at the highest level of that
    depth.
    """
    shot = plain(np.random.default_rng(4), Surface())
    eight = measured(shot.picture, Settings(BELOW_PX, Direction.UP))
    deep = (shot.picture.astype(np.uint16) << (bits - 8)) << shift
    deep += ((deep > 0) * (1 << shift)).astype(np.uint16)  # no bit below the depth is always zero
    assert top_level(deep) == (2**bits - 1) << shift
    found = measured(deep, Settings(BELOW_PX, Direction.UP))
    assert found.gap_px == pytest.approx(eight.gap_px, abs=1e-3)
    white = np.full_like(deep, (2**bits - 1) << shift)
    assert measure_frame(Frame(white, 0), Settings(BELOW_PX)).status is Status.SATURATED


def test_a_response_of_another_depth_is_refused() -> None:
    response = CameraResponse("mine", SHARE, SHARE, 255)
    picture = np.full((64, 64), 3000, dtype=np.uint16)
    with pytest.raises(DataError, match=r"255.*4095"):
        measure_frame(Frame(picture, 0), Settings(BELOW_PX, camera=stated_camera(response)))

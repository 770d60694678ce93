"""Camera responses: values stated in the standards, invalid curves, and exposures of a computed scene."""

import numpy as np
import pytest

from calib.camera_response import CameraResponse, standard_response
from calib.errors import CalibrationError
from calib.measured_response import response_from_exposures

# Half of the light is these levels of 255 (IEC 61966-2-1; ITU-R BT.709-6): 187.5 and 179.8.
HALF_LEVELS = {"linear": 127.5, "srgb": 187.52, "bt709": 179.84}


@pytest.mark.parametrize("name", HALF_LEVELS)
def test_half_of_the_light(name: str) -> None:
    response = standard_response(name)
    level = 255.0 * np.interp(0.5, response.light, response.level)
    assert level == pytest.approx(HALF_LEVELS[name], abs=0.05)
    table = response.table(255, 256)
    assert table[0] == 0.0
    assert table[255] == pytest.approx(255.0)


# Half of the light between black and white, in levels of a studio-range video: 16 to 235 of 255, 64 to 940 of 1023.
# BT.709: 0.70525 of the range. HLG: (c + a ln(6 - b)) = 0.87164 of it (BT.2100-2, table 5, by hand).
STUDIO_HALVES = {"bt709": (16 + 219 * 0.70525, 16, 235, 255), "hlg": (64 + 876 * 0.87164, 64, 940, 1023)}


@pytest.mark.parametrize("name", STUDIO_HALVES)
def test_half_of_the_light_in_studio_range(name: str) -> None:
    response = standard_response(f"{name}_studio")
    half, black, white, top = STUDIO_HALVES[name]
    dark, bright = np.interp([black / top, white / top], response.level, response.light)
    assert top * np.interp(0.5 * (dark + bright), response.light, response.level) == pytest.approx(half, abs=0.1)


@pytest.mark.parametrize("name", ["srgb_studio", "bt709_studio", "hlg_studio", "pq_studio"])
def test_studio_range_covers_every_stored_level(name: str) -> None:
    table = standard_response(name).table(1023, 1024)
    assert table[0] == 0.0
    assert table[1023] == pytest.approx(1023.0)
    assert (np.diff(table) > 0.0).all()


@pytest.mark.parametrize(
    ("level", "light", "words"),
    [
        ([0.0, 0.5, 1.0], [0.0, 0.2, 1.0], "at least"),
        (np.linspace(0, 1, 9), [0, 0.1, 0.2, 0.3, 0.25, 0.5, 0.6, 0.8, 1], "row 4"),
        (np.linspace(0, 0.5, 9), np.linspace(0, 1, 9), "full scale"),
        (np.linspace(0, 1, 9), [0, 0.1, 0.2, np.nan, 0.35, 0.5, 0.6, 0.8, 1], "numbers"),
    ],
)
def test_what_is_no_response(level: list[float], light: list[float], words: str) -> None:
    with pytest.raises(CalibrationError, match=words):
        CameraResponse("mine", np.array(level, dtype=float), np.array(light, dtype=float))


def test_another_depth_is_refused() -> None:
    share = np.linspace(0, 1, 16)
    with pytest.raises(CalibrationError, match=r"255.*4095"):
        CameraResponse("mine", share, share, 255).table(4095, 65536)


@pytest.mark.parametrize("exponent", [1.0, 0.7, 1.0 / 2.2])
@pytest.mark.parametrize("top", [255, 4095])
def test_exposures_of_a_drawn_scene(exponent: float, top: int) -> None:
    """With fields of many shades, five exposures and read noise of 0.1 %, the curve is found to 0.5 %."""
    rng = np.random.default_rng(7)
    scene = np.kron(rng.uniform(0.01, 1.0, (16, 20)), np.ones((24, 24)))
    times = [0.1, 0.25, 0.5, 1.0, 2.0]
    kind = np.uint8 if top == 255 else np.uint16
    pictures = [
        np.rint(top * np.clip(scene * time + 1e-3 * rng.standard_normal(scene.shape), 0.0, 1.0) ** exponent).astype(
            kind
        )
        for time in times
    ]
    found = response_from_exposures(pictures, times, top, "drawn")
    assert np.abs(found.response.light - found.response.level ** (1.0 / exponent)).max() < 0.005
    assert found.exponent == pytest.approx(1.0 / exponent, rel=0.03)


def test_exposures_too_alike() -> None:
    pictures = [np.full((64, 64), 100, dtype=np.uint8)] * 3
    with pytest.raises(CalibrationError, match="factor"):
        response_from_exposures(pictures, [1.0, 1.1, 1.2], 255, "mine")
    with pytest.raises(CalibrationError, match="uniform areas"):
        response_from_exposures([np.full((64, 64), 255, dtype=np.uint8)] * 3, [1.0, 2.0, 4.0], 255, "mine")

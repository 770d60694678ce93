"""A change of exposure half-way is found; noise, drifts, flicker and a passing shadow are none."""

from dataclasses import replace

import numpy as np
import pytest

from calib.calibration import BareScale
from calib.camera_response import standard_response
from fingervision.domain.camera import stated_camera
from fingervision.domain.direction import Direction
from fingervision.domain.frame import Coding
from fingervision.domain.gap import FingerEdge, GapMeasurement
from fingervision.frames.source import Description
from fingervision.measuring.light_change import light_change
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.series import GapSeries
from fingervision.measuring.summary import summarise

EDGE = FingerEdge(100.0, 50.0, 40.0, 0.01, 0.01, 0.0, 1.0, 150.0)
FRAMES = np.arange(60)
NOISE = 1.0 + 0.005 * np.random.default_rng(1).standard_normal(FRAMES.size)


@pytest.mark.parametrize(("at", "ratio"), [(6, 1.25), (30, 0.6), (54, 0.85)])
def test_a_step_is_found_where_it_is(at: int, ratio: float) -> None:
    found = light_change(150.0 * NOISE * np.where(at > FRAMES, 1.0, ratio))
    assert found is not None
    assert found.at == at
    assert found.ratio == pytest.approx(ratio, rel=0.01)


@pytest.mark.parametrize(
    "light",
    [
        np.ones(60),
        1.0 + 0.5 * FRAMES / 60,  # a drift
        1.0 + 0.3 * np.sin(FRAMES / 3.0),  # flicker
        np.where(np.abs(FRAMES - 30) < 5, 0.5, 1.0),  # a passing shadow
        np.where(FRAMES < 30, 1.0, 1.05),  # too small to matter
    ],
)
def test_what_is_no_lasting_step_is_not_accused(light: np.ndarray) -> None:
    assert light_change(150.0 * NOISE * light) is None
    assert light_change(150.0 * (NOISE * light)[:11]) is None


@pytest.mark.parametrize("is_known", [False, True])
def test_the_summary_says_from_which_frame_on(is_known: bool) -> None:
    series, maker = GapSeries(), RowMaker(BareScale(34.0), (640, 480))
    if is_known:
        series.camera = stated_camera(standard_response("srgb"))
    results = [
        Result(int(k), 0.04 * k, GapMeasurement(edge, replace(edge, x_px=200.0), Direction.UP, 0.01, True))
        for k in FRAMES
        for edge in [replace(EDGE, contrast=150.0 if k < 20 else 90.0)]
    ]
    series.add(results, maker.rows(results))
    recording = Description("drawn", "images", "raw", Coding.LOSSLESS, 640, 480, 25.0, True, FRAMES.size)
    advice = summarise(recording, {"below_tip_mm": 0.3}, BareScale(34.0), None, series, complete=True)["advice"]
    said = [words for words in advice if words.startswith("From frame 20 on")]
    assert len(said) == (0 if is_known else 1)
    assert all("0.60 times" in words and "--frames 20:59" in words for words in said)

"""A run whose camera settings differ from those of the calibration is measured, with a note about the difference."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib.measured_scale import Calibration
from fingervision.domain.frame import Frame
from fingervision.frames.source_kinds import open_source
from fingervision.measuring.measure import measure
from fingervision.measuring.task import Task
from fingervision.rendering import Camera, render, two_fingers
from tests.clips import FFV1, write_clip

SIZE_PX = (240, 200)
SETTINGS = {"format": "YUYV", "exposure": "8 ms", "focus": "30"}


@pytest.fixture
def video(tmp_path: Path) -> Path:
    scene = two_fingers(80.0, below_tip_px=6.0, width_px=40.0, frame=SIZE_PX)
    picture = render(scene, Camera(blur_px=0.9, noise_grey=1.0), np.random.default_rng(1))
    write_clip(tmp_path / "video.mkv", (Frame(picture, k, 0.04 * k) for k in range(3)), FFV1)
    return tmp_path / "video.mkv"


@pytest.mark.parametrize(
    ("run", "sentence"),
    [
        ({"video": "video.mkv", "device": {"camera": SETTINGS}}, ""),
        (
            {"video": "video.mkv", "device": {"camera": {**SETTINGS, "focus": "45"}}},
            "The calibration was made with the camera's focus = 30, but now focus is 45",
        ),
        ({"video": "video.mkv", "device": {"camera": {"zoom": "100"}}}, ""),
        ({"video": "another.mkv", "device": {"camera": {"focus": "45"}}}, ""),
        (["something", "else"], ""),
    ],
)
def test_only_a_setting_that_both_state_and_that_differs_is_said(video: Path, run: object, sentence: str) -> None:
    (video.parent / "run.json").write_text(json.dumps(run), encoding="utf-8")
    scale = Calibration(20.0, 0.0, (), SIZE_PX, camera=SETTINGS)
    measured = measure(open_source(str(video)), Task(scale), video.parent / "out")
    said = [words for words in measured.summary["advice"] if "calibration" in words]
    assert measured.summary["gap"]["count"] == 3
    assert [words.startswith(sentence) for words in said] == [True] * bool(sentence)

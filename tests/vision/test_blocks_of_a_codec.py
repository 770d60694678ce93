"""Errors of a codec over its blocks are no dirt on an outline: every frame of a plain recording is measured."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.frames.source_kinds import open_source
from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.pipeline import Settings, measure_frame
from tests import clips

COUNT, BELOW_TIP_PX, CAMERA = 60, 9.0, Camera(blur_px=0.9, noise_grey=1.5)


@pytest.mark.parametrize("seed", [1, 3])
def test_every_frame_of_a_plain_recording_through_h264_has_a_gap(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    gaps_px = 60.0 + 40.0 * np.sin(np.arange(COUNT) / 9.0 + rng.uniform(0.0, 6.0))
    scenes = (two_fingers(float(g), below_tip_px=BELOW_TIP_PX, width_px=50.0, frame=(320, 96)) for g in gaps_px)
    frames = [Frame(render(scene, CAMERA, rng), k, k / 25) for k, scene in enumerate(scenes)]
    clips.write_clip(tmp_path / "clip.mp4", frames, clips.h264(16))
    for item, gap_px in zip(open_source(str(tmp_path / "clip.mp4")), gaps_px, strict=True):
        assert isinstance(item, Frame)
        found = measure_frame(item, Settings(BELOW_TIP_PX))
        assert isinstance(found, GapMeasurement), (item.index, found.words)
        assert abs(found.gap_px - gap_px) < 3.0 * np.hypot(found.u_gap_px, found.u_picture_px), item.index

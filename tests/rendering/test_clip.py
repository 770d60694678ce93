"""Clips of the tests: full-range luma that is the frame but for the loss, and the same bytes again."""

from pathlib import Path

import av
import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.frames.luma import luma
from fingervision.rendering.camera import Camera
from fingervision.rendering.picture import render
from fingervision.rendering.two_fingers import two_fingers
from tests.clips import Codec, h264, mjpeg, write_clip


def some_frames(camera: Camera, count: int = 6) -> list[Frame]:
    rng = np.random.default_rng(3)
    times_s = np.cumsum(rng.uniform(0.02, 0.09, count))
    return [
        Frame(render(two_fingers(60.0 + i, frame=(160, 120), width_px=30.0), camera, rng), i, float(times_s[i]))
        for i in range(count)
    ]


@pytest.mark.parametrize(("codec", "loss_grey"), [(h264(crf=18.0), 1.5), (h264(crf=28.0), 3.0), (mjpeg(2), 1.5)])
def test_the_luma_of_a_lossy_clip_is_the_frame_but_for_the_loss(tmp_path: Path, codec: Codec, loss_grey: float) -> None:
    """Full range: levels are not scaled."""
    frames = some_frames(Camera())
    write_clip(tmp_path / "clip.mp4", frames, codec)
    with av.open(tmp_path / "clip.mp4") as container:
        pictures = [luma(picture) for picture in container.decode(video=0)]
    for frame, picture in zip(frames, pictures, strict=True):
        error = picture.astype(float) - frame.pixels
        assert abs(error.mean()) < 0.5
        assert np.sqrt(np.mean(error**2)) < loss_grey


def test_the_same_frames_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one.mp4", "two.mp4"):
        write_clip(tmp_path / name, some_frames(Camera(noise_grey=2.0)), h264())
    assert (tmp_path / "one.mp4").read_bytes() == (tmp_path / "two.mp4").read_bytes()

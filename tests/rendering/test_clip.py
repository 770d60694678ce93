"""Clips and JPEG: exact times, lossless storage where promised, and errors of lossy compression."""

from pathlib import Path

import av
import numpy as np
import pytest

from fingervision.domain.errors import DataError, OutputError
from fingervision.domain.frame import Frame
from fingervision.rendering.camera import Camera
from fingervision.rendering.clip import H264, Codec, Ffv1, Mjpeg, through_jpeg, write_clip
from fingervision.rendering.picture import render
from fingervision.rendering.two_fingers import two_fingers

# Half a tick of 1/90000 s, and half a millisecond in Matroska.
TIME_S = {".mp4": 0.5 / 90_000 + 1e-12, ".mov": 0.5 / 90_000 + 1e-12, ".mkv": 0.5e-3 + 1e-12}


def some_frames(camera: Camera, count: int = 6) -> list[Frame]:
    rng = np.random.default_rng(3)
    times_s = np.cumsum(rng.uniform(0.02, 0.09, count))
    return [
        Frame(render(two_fingers(60.0 + i, frame=(160, 120), width_px=30.0), camera, rng), i, float(times_s[i]))
        for i in range(count)
    ]


def read(path: Path) -> tuple[list[float], list[av.VideoFrame]]:
    with av.open(path) as container:
        frames = list(container.decode(video=0))
    return [float(frame.pts * frame.time_base) for frame in frames], frames


def luma(frame: av.VideoFrame) -> np.ndarray:
    plane = frame.planes[0]
    return np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)[: frame.height, : frame.width]


@pytest.mark.parametrize(("suffix", "codec"), [(".mp4", H264()), (".mov", Mjpeg()), (".mkv", Ffv1()), (".mkv", H264())])
def test_frames_keep_their_uneven_times(tmp_path: Path, suffix: str, codec: Codec) -> None:
    frames = some_frames(Camera(noise_grey=2.0))
    write_clip(tmp_path / f"clip{suffix}", frames, codec)
    times_s, read_frames = read(tmp_path / f"clip{suffix}")
    assert len(read_frames) == len(frames)
    assert np.max(np.abs(np.array(times_s) - [frame.time_s for frame in frames])) < TIME_S[suffix]


@pytest.mark.parametrize(
    "camera", [Camera(noise_grey=3.0), Camera(noise_grey=3.0, bits=16), Camera(tint=(1.0, 0.8, 0.6))]
)
def test_ffv1_gives_back_every_pixel(tmp_path: Path, camera: Camera) -> None:
    frames = some_frames(camera)
    write_clip(tmp_path / "clip.mkv", frames, Ffv1())
    for frame, picture in zip(frames, read(tmp_path / "clip.mkv")[1], strict=True):
        assert np.array_equal(picture.to_ndarray(format="rgb24" if camera.tint else None), frame.pixels)


@pytest.mark.parametrize(("codec", "loss_grey"), [(H264(crf=18.0), 1.5), (H264(crf=28.0), 3.0), (Mjpeg(2), 1.5)])
@pytest.mark.parametrize("tint", [None, (1.0, 1.0, 1.0)])
def test_the_luma_of_a_lossy_clip_is_the_frame_but_for_the_loss(
    tmp_path: Path, codec: Codec, loss_grey: float, tint: tuple[float, float, float] | None
) -> None:
    """Full range: levels are not scaled, and equal colours give the same grey level."""
    frames = some_frames(Camera(tint=tint))
    write_clip(tmp_path / "clip.mp4", frames, codec)
    for frame, picture in zip(frames, read(tmp_path / "clip.mp4")[1], strict=True):
        true = frame.pixels if tint is None else frame.pixels[..., 0]
        error = luma(picture).astype(float) - true
        assert abs(error.mean()) < 0.5
        assert np.sqrt(np.mean(error**2)) < loss_grey


def test_the_same_frames_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one.mp4", "two.mp4"):
        write_clip(tmp_path / name, some_frames(Camera(noise_grey=2.0)), H264())
    assert (tmp_path / "one.mp4").read_bytes() == (tmp_path / "two.mp4").read_bytes()


def test_jpeg_loses_more_at_lower_quality() -> None:
    (frame,) = some_frames(Camera(noise_grey=2.0), count=1)
    losses = [np.std(through_jpeg(frame.pixels, quality).astype(float) - frame.pixels) for quality in (98, 80, 30)]
    assert losses[0] < losses[1] < losses[2] < 4.0
    (colour,) = some_frames(Camera(tint=(1.0, 0.6, 0.2)), count=1)
    assert np.abs(through_jpeg(colour.pixels, 95).astype(float) - colour.pixels).mean() < 2.0


def test_refusals_say_what_must_be(tmp_path: Path) -> None:
    frames = some_frames(Camera())
    wide = some_frames(Camera(bits=16))
    untimed = [Frame(frames[0].pixels, 0)]
    backwards = [Frame(frames[0].pixels, 0, 1.0), Frame(frames[0].pixels, 1, 0.5)]
    mixed = [frames[0], Frame(frames[0].pixels[:60], 1, 9.0)]
    odd = [Frame(frames[0].pixels[:119], 0, 0.0)]
    for bad, codec, words in [
        ([], H264(), r"at least one frame, but clip.mp4 would have none"),
        (untimed, H264(), r"must have its time, but frame 0 has none"),
        (backwards, H264(), r"increase, but frame 1 is at 0.5 s, after 1 s"),
        (mixed, H264(), r"frames of a clip must have the same shape and type, but frame 1 is \(60, 160\)"),
        (odd, H264(), r"H264 needs an even width and height, but the frames have 160 x 119 pixels"),
        (wide, Mjpeg(), r"Mjpeg holds 8 bits, but the frames have 16"),
        (some_frames(Camera(bits=16, tint=(1.0, 1.0, 1.0))), Ffv1(), r"FFV1 clips hold colour with 8 bits"),
    ]:
        with pytest.raises(DataError, match=words):
            write_clip(tmp_path / "clip.mp4", bad, codec)
    with pytest.raises(OutputError, match=r"must end in .mp4, .mov, .mkv, .* but is clip.avi"):
        write_clip(tmp_path / "clip.avi", frames, H264())
    with pytest.raises(OutputError, match=r"must be a file that can be written, but it could not be: No such file"):
        write_clip(tmp_path / "missing" / "clip.mp4", frames, H264())
    with pytest.raises(DataError, match=r"quality must lie between 0 and 100, but is 101"):
        through_jpeg(frames[0].pixels, 101)
    with pytest.raises(DataError, match=r"JPEG stores 8 bits, but the frame has 16"):
        through_jpeg(wide[0].pixels, 90)

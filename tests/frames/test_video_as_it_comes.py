"""Videos as written by phones and cameras: sound, several tracks, cover pictures, high dynamic range, uneven times."""

import zlib
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from calib.camera_response import standard_response
from fingervision.domain.errors import DataError
from fingervision.frames.source import Wish
from fingervision.frames.transfer_tag import transfer_tag
from fingervision.frames.video_file import open_frames

LEVELS = (40, 90, 140, 190)


def picture(level: int, size: tuple[int, int] = (64, 48), form: str = "gray") -> av.VideoFrame:
    dtype = np.uint8 if form == "gray" else np.uint16
    plane = np.full((size[1], size[0]), level, dtype=dtype)
    plane[:, : size[0] // 2] = level // 2
    return av.VideoFrame.from_ndarray(plane, format=form)


def write(path: Path, *, ticks: tuple[int, ...] = (0, 1, 2, 3), second: bool = False, sound: bool = False) -> Path:
    """FFV1 in Matroska, with times in tenths of a second."""
    with av.open(str(path), "w", format="matroska") as container:
        streams = [container.add_stream("ffv1", rate=10)]
        if second:
            streams.append(container.add_stream("ffv1", rate=10))
        audio = container.add_stream("pcm_s16le", rate=8000) if sound else None
        for k, stream in enumerate(streams):
            stream.width, stream.height, stream.pix_fmt = 64 if k == 0 else 32, 48, "gray"
            stream.time_base = stream.codec_context.time_base = Fraction(1, 10)
        for tick, level in zip(ticks, LEVELS, strict=True):
            for k, stream in enumerate(streams):
                frame = picture(level, (64 if k == 0 else 32, 48))
                frame.pts, frame.time_base = tick, Fraction(1, 10)
                container.mux(stream.encode(frame))
            if audio is not None:
                sound_frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), dtype=np.int16), "s16", "mono")
                sound_frame.sample_rate, sound_frame.pts = 8000, 800 * tick
                sound_frame.time_base = Fraction(1, 8000)
                container.mux(audio.encode(sound_frame))
        for stream in [*streams, *([audio] if audio is not None else [])]:
            container.mux(stream.encode())
    return path


def means(path: Path) -> list[int]:
    return [int(frame.pixels[:, -1].mean()) for frame in open_frames(str(path), Wish())]


def test_sound_does_not_matter(tmp_path: Path) -> None:
    assert means(write(tmp_path / "sound.mkv", sound=True)) == list(LEVELS)


def test_uneven_times_are_those_of_the_file(tmp_path: Path) -> None:
    found = list(open_frames(str(write(tmp_path / "uneven.mkv", ticks=(0, 1, 5, 6))), Wish()))
    np.testing.assert_allclose([frame.time_s for frame in found], [0.0, 0.1, 0.5, 0.6], atol=1e-9)


def test_the_first_of_several_videos_is_measured_and_that_is_said(tmp_path: Path) -> None:
    frames = open_frames(str(write(tmp_path / "two.mkv", second=True)), Wish())
    assert (frames.description.width_px, frames.description.height_px) == (64, 48)
    assert any("2 videos" in note for note in frames.description.notes)
    assert [int(frame.pixels[:, -1].mean()) for frame in frames] == list(LEVELS)


def test_a_file_under_a_camera_makers_name_is_read_by_what_it_holds(tmp_path: Path) -> None:
    assert means(write(tmp_path / "VID_0001.insv")) == list(LEVELS)


@pytest.mark.parametrize("suffix", [".mraw", ".cihx", ".cine"])
def test_a_high_speed_cameras_own_file_says_what_to_export(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"run{suffix}"
    path.write_bytes(bytes(range(256)) * 40)
    with pytest.raises(DataError, match="export"):
        open_frames(str(path), Wish())


@pytest.mark.parametrize("stated", [1, 2], ids=["studio", "full"])
@pytest.mark.parametrize(("number", "name"), [(16, "pq"), (18, "hlg"), (1, "bt709")])
def test_high_dynamic_range_is_read_with_its_own_curve(
    number: int, name: str, stated: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if av.__version__.startswith("14."):
        pytest.skip("PyAV 14 makes no frame of 10 bits from an array")
    monkeypatch.chdir(tmp_path)
    path = Path("12:30:05.mkv")  # FFmpeg takes what precedes a colon for a protocol
    with av.open(f"file:{path}", "w") as container:
        stream = container.add_stream("ffv1", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "gray10le"
        stream.codec_context.color_trc, stream.codec_context.color_range = number, stated
        container.mux(stream.encode(picture(700, form="gray10le")))
        container.mux(stream.encode())
    assert transfer_tag((path,)) == (f"{name}_studio" if stated == 1 else name)
    frame = next(iter(open_frames(str(path), Wish())))
    assert abs(int(frame.pixels[0, -1]) / 65535 - 700 / 1023) < 1e-4


def test_curves_of_high_dynamic_range_are_those_of_the_standard() -> None:
    hlg, pq = standard_response("hlg"), standard_response("pq")
    # BT.2100-2, table 5: E' = 0.5 is a twelfth of the light; BT.2408, table 1: 75 % HLG is 26.5 % of it.
    assert np.interp([0.5, 0.75], hlg.level, hlg.light) == pytest.approx([1.0 / 12.0, 0.265], abs=5e-4)
    # BT.2408: 203 cd/m2 is a PQ signal of 58 %; its OOTF was worked out by hand: (203/100)^(1/2.4) = 1.343.
    light = ((1.343 + 0.0993) / 1.0993) ** (1.0 / 0.45) / 59.5208
    assert np.interp(0.5807, pq.level, pq.light) == pytest.approx(light, rel=2e-3)


@pytest.mark.parametrize(
    ("kind", "body", "name"),
    [
        (b"sRGB", b"\0", "srgb"),
        (b"gAMA", (45455).to_bytes(4, "big"), "srgb"),
        (b"gAMA", (100000).to_bytes(4, "big"), "linear"),
        (b"gAMA", (50000).to_bytes(4, "big"), None),
        (b"tEXt", b"Title\0none", None),
    ],
)
def test_a_png_picture_states_its_curve(kind: bytes, body: bytes, name: str | None, tmp_path: Path) -> None:
    png = cv2.imencode(".png", np.full((48, 64), 128, np.uint8))[1].tobytes()
    behind_head = 33  # the signature, and the chunk IHDR
    chunk = len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")
    files = (tmp_path / "1.png", tmp_path / "2.png")
    for file in files:
        file.write_bytes(png[:behind_head] + chunk + png[behind_head:])
    assert transfer_tag(files) == transfer_tag(files[:1]) == name

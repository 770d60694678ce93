"""Video files: exact times, unchanged luma, and lost frames where a file is damaged."""

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, InputFileError, UsageError
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.source import Wish
from fingervision.frames.source_kinds import open_source
from tests.clips import FFV1, Codec, h264, mjpeg, write_clip

# Matroska rounds a time to its tick of 1 ms; MP4 keeps the 90 kHz clock's tick.
MATROSKA_TICK_S, MP4_TICK_S = 0.5e-3 + 1e-9, 0.5 / 90_000 + 1e-9
UNEVEN_TIMES_S = (0.0, 0.04, 0.05, 0.2, 0.201, 1.0, 1.04, 7.5)


def pictures(count: int, seed: int = 0, size: tuple[int, int] = (48, 64)) -> list[NDArray[np.uint8]]:
    rng = np.random.default_rng(seed)
    return [rng.integers(0, 256, size, dtype=np.uint8) for _ in range(count)]


def smooth_pictures(count: int) -> list[NDArray[np.uint8]]:
    x, y = np.meshgrid(np.arange(64), np.arange(48))
    return [(128 + 100 * np.sin((x + k) / 9.0) * np.cos(y / 7.0)).astype(np.uint8) for k in range(count)]


def timed(levels: list[NDArray[np.uint8]], times_s: tuple[float, ...] | None = None) -> Iterator[Frame]:
    times = times_s or tuple(0.04 * k for k in range(len(levels)))
    return (Frame(picture, k, time) for k, (picture, time) in enumerate(zip(levels, times, strict=True)))


def read(path: Path) -> list[Frame | LostFrame]:
    return list(open_source(str(path)))


def statuses(items: list[Frame | LostFrame]) -> list[Status]:
    return [Status.OK if isinstance(item, Frame) else item.status for item in items]


@pytest.mark.parametrize(("suffix", "tick_s"), [(".mkv", MATROSKA_TICK_S), (".mp4", MP4_TICK_S), (".mov", MP4_TICK_S)])
def test_times_are_the_containers_own_also_at_a_changing_rate(tmp_path: Path, suffix: str, tick_s: float) -> None:
    path = tmp_path / f"clip{suffix}"
    write_clip(path, timed(smooth_pictures(8), UNEVEN_TIMES_S), h264())
    found = read(path)
    assert statuses(found) == [Status.OK] * 8
    assert [item.time_s for item in found] == pytest.approx(UNEVEN_TIMES_S, abs=tick_s)


def test_a_track_may_state_the_sum_of_its_durations_or_the_time_that_it_is_shown(tmp_path: Path) -> None:
    # FFmpeg of PyAV 19 states the sum; with uneven times and another order of storage it is shorter than what is shown.
    path = tmp_path / "clip.mp4"
    write_clip(path, timed(smooth_pictures(8), UNEVEN_TIMES_S), h264())
    content = bytearray(path.read_bytes())
    at = content.index(b"mdhd") + 4 + 4 + 8 + 4  # version and flags, two dates, ticks a second
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        total = sum(packet.duration or 0 for packet in container.demux(stream))
    content[at : at + 4] = total.to_bytes(4, "big")
    path.write_bytes(content)
    assert [item.time_s for item in read(path)] == pytest.approx(UNEVEN_TIMES_S, abs=MP4_TICK_S)


def test_luma_of_a_lossless_grey_clip_is_the_frame_itself(tmp_path: Path) -> None:
    levels = pictures(3, size=(47, 61))  # rows are padded in the decoder's memory
    write_clip(tmp_path / "clip.mkv", timed(levels), FFV1)
    found = read(tmp_path / "clip.mkv")
    for item, level in zip(found, levels, strict=True):
        assert isinstance(item, Frame)
        assert not item.lossy
        np.testing.assert_array_equal(item.pixels, level)


def test_sixteen_bits_and_colours_come_back_exactly(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for name, levels in (
        ("wide.mkv", rng.integers(0, 65536, (48, 64), dtype=np.uint16)),
        ("colour.mkv", rng.integers(0, 256, (48, 64, 3), dtype=np.uint8)),
    ):
        write_clip(tmp_path / name, [Frame(levels, 0, 0.0)], FFV1)
        (item,) = read(tmp_path / name)
        assert isinstance(item, Frame)
        np.testing.assert_array_equal(item.pixels, levels)


def write_planes(path: Path, pixel_format: str, memory: list[bytes]) -> None:
    """A lossless frame whose planes hold these bytes; its lines are 64 elements long, and no padding is needed."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1" if pixel_format != "yuyv422" else "rawvideo", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, pixel_format
        picture = av.VideoFrame(64, 48, pixel_format)
        for plane, content in zip(picture.planes, memory, strict=True):
            lines = np.frombuffer(content, np.uint8).reshape(plane.height, -1)
            padded = np.zeros((plane.height, plane.line_size), np.uint8)
            padded[:, : lines.shape[1]] = lines
            plane.update(padded.tobytes())
        picture.pts, picture.time_base = 0, Fraction(1, 25)
        container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


@pytest.mark.parametrize("bits", [10, 12])
def test_ten_and_twelve_bits_fill_the_range_of_sixteen(tmp_path: Path, bits: int) -> None:
    top = 2**bits - 1
    levels = np.random.default_rng(bits).integers(0, top + 1, (48, 64), dtype=np.uint16)
    levels[0, :2] = 0, top
    write_planes(tmp_path / "clip.mkv", f"gray{bits}le", [levels.tobytes()])
    (item,) = read(tmp_path / "clip.mkv")
    assert isinstance(item, Frame)
    assert item.pixels.dtype == np.uint16
    assert item.pixels[0, 0] == 0
    assert item.pixels[0, 1] == 65535
    np.testing.assert_array_equal(item.pixels >> (16 - bits), levels)


def test_limited_range_luma_is_not_stretched_and_colour_does_not_matter(tmp_path: Path) -> None:
    luma = np.random.default_rng(5).integers(16, 236, (48, 64), dtype=np.uint8)
    colour = np.random.default_rng(6).integers(0, 256, (24, 32), dtype=np.uint8)
    write_planes(tmp_path / "clip.mkv", "yuv420p", [luma.tobytes(), colour.tobytes(), colour.T.tobytes()])
    (item,) = read(tmp_path / "clip.mkv")
    assert isinstance(item, Frame)
    np.testing.assert_array_equal(item.pixels, luma)


def test_packed_luma_of_a_usb_camera(tmp_path: Path) -> None:
    packed = np.random.default_rng(7).integers(0, 256, (48, 128), dtype=np.uint8)
    write_planes(tmp_path / "clip.avi", "yuyv422", [packed.tobytes()])
    (item,) = read(tmp_path / "clip.avi")
    assert isinstance(item, Frame)
    np.testing.assert_array_equal(item.pixels, packed[:, ::2])


@pytest.mark.parametrize(
    ("codec", "coding"), [(FFV1, Coding.LOSSLESS), (mjpeg(), Coding.INTRAFRAME), (h264(), Coding.INTERFRAME)]
)
def test_the_codec_says_what_was_lost(tmp_path: Path, codec: Codec, coding: Coding) -> None:
    write_clip(tmp_path / "clip.mkv", timed(smooth_pictures(2)), codec)
    source = open_source(str(tmp_path / "clip.mkv"))
    assert source.description.coding is coding
    assert all(isinstance(item, Frame) and item.coding is coding for item in source)


def mux_mjpeg(path: Path, sizes: list[tuple[int, int]], ticks: list[int]) -> None:
    """Motion JPEG with frames of these sizes at these milliseconds."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=25)
        stream.width, stream.height, stream.pix_fmt = *sizes[0], "yuvj420p"
        for (width, height), tick in zip(sizes, ticks, strict=True):
            encoder = av.CodecContext.create("mjpeg", "w")
            encoder.width, encoder.height, encoder.pix_fmt = width, height, "yuvj420p"
            encoder.time_base = Fraction(1, 1000)
            picture = av.VideoFrame(width, height, "yuvj420p")
            picture.pts = tick
            for packet in (*encoder.encode(picture), *encoder.encode(None)):
                packet.stream, packet.pts, packet.dts, packet.time_base = stream, tick, tick, Fraction(1, 1000)
                container.mux(packet)


def test_a_frame_of_another_size_is_damaged_and_the_rest_is_read(tmp_path: Path) -> None:
    mux_mjpeg(tmp_path / "clip.mkv", [(64, 48), (64, 48), (32, 32), (64, 48)], [0, 40, 80, 120])
    found = read(tmp_path / "clip.mkv")
    assert statuses(found) == [Status.OK, Status.OK, Status.DAMAGED, Status.OK]
    assert isinstance(found[2], LostFrame)
    assert found[2].words == "The frame has 32x32 pixels, but the recording has 64x48."


def test_a_repeated_time_is_a_duplicate_and_equal_pictures_are_not(tmp_path: Path) -> None:
    mux_mjpeg(tmp_path / "clip.mkv", [(64, 48)] * 4, [0, 40, 40, 120])
    assert statuses(read(tmp_path / "clip.mkv")) == [Status.OK, Status.OK, Status.DUPLICATE, Status.OK]


@pytest.mark.parametrize("codec", [FFV1, h264(), mjpeg()])
def test_what_is_there_of_a_clip_cut_off_is_read_and_then_it_is_damaged(tmp_path: Path, codec: Codec) -> None:
    write_clip(tmp_path / "whole.mkv", timed(pictures(50)), codec)
    content = (tmp_path / "whole.mkv").read_bytes()
    (tmp_path / "cut.mkv").write_bytes(content[: len(content) // 2])
    whole, cut = read(tmp_path / "whole.mkv"), read(tmp_path / "cut.mkv")
    assert statuses(whole) == [Status.OK] * 50
    good = [item for item in cut if isinstance(item, Frame)]
    assert 15 <= len(good) < 30
    assert [item.time_s for item in good] == [item.time_s for item in whole[: len(good)]]
    assert isinstance(cut[-1], LostFrame)
    assert "The recording is truncated here: the file states 2.00 s but contains" in cut[-1].words


def test_flipped_bytes_in_a_lossless_clip_fail_their_checksum(tmp_path: Path) -> None:
    write_clip(tmp_path / "clip.mkv", timed(pictures(20)), FFV1)
    content = bytearray((tmp_path / "clip.mkv").read_bytes())
    content[len(content) // 2] ^= 0xFF
    (tmp_path / "flipped.mkv").write_bytes(content)
    whole, flipped = read(tmp_path / "clip.mkv"), read(tmp_path / "flipped.mkv")
    # The damaged frame and what is predicted from it; the next key frame comes within twelve.
    assert 1 <= statuses(flipped).count(Status.DAMAGED) <= 12
    assert statuses(flipped)[-1] is Status.OK
    for item, other in zip(whole, flipped, strict=True):
        if isinstance(other, Frame):
            assert isinstance(item, Frame)
            np.testing.assert_array_equal(item.pixels, other.pixels)


def test_behind_damage_that_the_decoder_notices_nothing_wrong_passes_as_whole(tmp_path: Path) -> None:
    # H.264 has no checksum: a decoder may miss the damage itself, but what follows its first complaint is known.
    write_clip(tmp_path / "clip.mkv", timed(smooth_pictures(60)), h264())
    content = (tmp_path / "clip.mkv").read_bytes()
    truth = {item.time_s: item for item in read(tmp_path / "clip.mkv")}
    noticed = 0
    for seed in range(6):
        broken = bytearray(content)
        at = len(content) * (seed + 3) // 12
        broken[at : at + 60] = np.random.default_rng(seed).integers(0, 256, 60, dtype=np.uint8).tobytes()
        (tmp_path / "broken.mkv").write_bytes(broken)
        found = read(tmp_path / "broken.mkv")
        first = next((k for k, item in enumerate(found) if isinstance(item, LostFrame)), len(found))
        noticed += first < len(found)
        for item in found[first:]:
            if isinstance(item, Frame):
                whole = truth[item.time_s]
                assert isinstance(whole, Frame)
                np.testing.assert_array_equal(item.pixels, whole.pixels)
    assert noticed >= 3


def test_a_second_pass_reads_the_same(tmp_path: Path) -> None:
    write_clip(tmp_path / "clip.mp4", timed(smooth_pictures(5)), h264())
    source = open_source(str(tmp_path / "clip.mp4"))
    for first, second in zip(source, source, strict=True):
        assert isinstance(first, Frame)
        assert isinstance(second, Frame)
        np.testing.assert_array_equal(first.pixels, second.pixels)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "must be a video, but the file is empty"),
        (b"this is a text\n" * 40, "must be a video, but cannot be read as one"),
    ],
)
def test_what_is_no_video_is_refused_in_a_sentence(tmp_path: Path, content: bytes, sentence: str) -> None:
    (tmp_path / "clip.mp4").write_bytes(content)
    with pytest.raises(DataError, match=sentence):
        open_source(str(tmp_path / "clip.mp4"))


def test_sound_alone_is_no_video(tmp_path: Path) -> None:
    with av.open(str(tmp_path / "sound.wav"), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000)
        stream.layout = "mono"
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        sound.sample_rate = 8000
        container.mux(stream.encode(sound))
    with pytest.raises(DataError, match="must contain a video, but has no video stream"):
        open_source(str(tmp_path / "sound.wav"))


def test_a_rate_is_refused_for_what_has_times(tmp_path: Path) -> None:
    write_clip(tmp_path / "clip.mp4", timed(smooth_pictures(2)), h264())
    with pytest.raises(UsageError, match="is a video with its own times: leave --rate-hz out"):
        open_source(str(tmp_path / "clip.mp4"), Wish(rate_hz=25.0))


def test_what_is_not_there_is_named() -> None:
    with pytest.raises(InputFileError, match=r"There is no recording nowhere\.mp4"):
        open_source("nowhere.mp4")

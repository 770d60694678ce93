"""Missing pictures: every frame that is passed on as undamaged shows the complete recording's picture of that time."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.frames.decoded_picture import luma
from fingervision.frames.source_kinds import open_source
from tests import clips

RATE_HZ, COUNT, SIZE_PX = 25, 90, (96, 64)
KINDS: dict[str, dict[str, str]] = {
    "in order": {"g": "20", "bf": "0"},
    "pyramid": {"g": "20", "bf": "4"},
    # frame_num has four bits: a lost key frame leaves no hole in the numbers.
    "groups of 16": {"g": "16", "bf": "0", "sc_threshold": "0"},
    "open groups": {"g": "20", "bf": "2", "x264-params": "open-gop=1"},
    "refresh": {"g": "20", "bf": "0", "x264-params": "intra-refresh=1"},
    "interlaced": {"g": "20", "bf": "2", "flags": "+ildct+ilme", "x264-params": "interlaced=1"},
    "slices": {"g": "20", "bf": "2", "x264-params": "slices=4"},
}


def coded(
    path: Path, coder: str = "libx264", ticks: Sequence[int] = range(COUNT), **options: str
) -> dict[float, NDArray[np.uint8]]:
    """Write a moving pattern, and return the decoded pictures of the complete file by time."""
    x, y = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
    still = np.random.default_rng(4).integers(0, 40, x.shape)
    levels = (
        (100 + 60 * np.sin((x + 1.7 * k) / 6.0) * np.cos(y / 7.0) + still).astype(np.uint8) for k in range(len(ticks))
    )
    clips.coded(path, levels, clips.Codec(coder, "yuv420p", options), rate_hz=RATE_HZ, ticks=ticks)
    return shown(path)


def shown(path: Path) -> dict[float, NDArray[np.uint8]]:
    """Pictures that FFmpeg alone decodes from a file."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.time_base is not None
        return {
            round(float(picture.pts * stream.time_base), 4): np.array(luma(picture))
            for picture in container.decode(stream)
            if picture.pts is not None
        }


def without(path: Path, gone: set[int]) -> Path:
    """Remove whole packets, counted in decoding order."""
    fewer = path.with_name(f"fewer{path.suffix}")
    with av.open(str(path)) as whole, av.open(str(fewer), "w") as container:
        stream = whole.streams.video[0]
        copied = container.add_stream_from_template(stream, opaque=True)
        packets = [packet for packet in whole.demux(stream) if packet.size]
        for number, packet in enumerate(packets):
            if number not in gone:
                packet.stream = copied
                container.mux(packet)
    return fewer


def wrong(path: Path, truth: dict[float, NDArray[np.uint8]]) -> list[float]:
    """Times of damaged frames that are passed on as undamaged."""
    return [
        item.time_s
        for item in open_source(str(path))
        if isinstance(item, Frame)
        and item.time_s is not None
        and not np.array_equal(item.pixels, truth[round(item.time_s, 4)])
    ]


def statuses(path: Path) -> str:
    """One letter for each frame: undamaged or damaged."""
    return "".join("." if isinstance(item, Frame) else "x" for item in open_source(str(path)))


@pytest.mark.parametrize("kind", KINDS)
def test_no_frame_that_hangs_on_a_missing_one_is_whole(tmp_path: Path, kind: str) -> None:
    suffix = (".mp4", ".mkv", ".ts")[list(KINDS).index(kind) % 3]
    path = tmp_path / f"clip{suffix}"
    truth = coded(path, **KINDS[kind])
    rng = np.random.default_rng(len(kind))
    for _ in range(2):
        gone = {int(k) for k in rng.choice(np.arange(1, COUNT - 2), rng.integers(1, 4), replace=False)}
        assert wrong(without(path, gone), truth) == [], gone


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".mp4", ".ts"])
@pytest.mark.parametrize("kind", ["groups of 16", "pyramid"])
def test_no_frame_behind_a_burst_is_whole(tmp_path: Path, kind: str, suffix: str) -> None:
    path = tmp_path / f"clip{suffix}"
    truth = coded(path, **KINDS[kind])
    rng = np.random.default_rng([7, len(kind), len(suffix)])
    for length in (15, 16, 17, 32):  # once around the numbers
        begin = int(rng.integers(2, COUNT - length - 4))
        gone = set(range(begin, begin + length))
        assert wrong(without(path, gone), truth) == [], gone


def test_the_second_frame_of_all_may_be_missing(tmp_path: Path) -> None:
    # Nothing but the numbers tells: there is no even row yet, and no packet is incomplete.
    path = tmp_path / "clip.ts"
    truth = coded(path, g="20", bf="0")
    fewer = without(path, {1})
    assert wrong(fewer, truth) == []
    assert statuses(fewer).lstrip("x.") == ""
    assert statuses(fewer).endswith("." * (COUNT - 20))


@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".ts"])
def test_a_missing_picture_on_which_none_hangs_costs_no_other(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"clip{suffix}"
    coded(path, g="20", bf="2", **{"x264-params": "b-pyramid=none"})
    with av.open(str(path)) as container:
        packets = [bytes(packet) for packet in container.demux(video=0) if packet.size]
    unneeded = {k for k, packet in enumerate(packets) if k % 20 > 1 and _hangs_nothing_on(packet, suffix)}
    gone = set(sorted(unneeded)[3:30:7])
    assert len(gone) >= 3
    assert statuses(without(path, gone)).count(".") == COUNT - len(gone)


def _hangs_nothing_on(packet: bytes, suffix: str) -> bool:
    """Whether the first slice's unit has nal_ref_idc 0."""
    if suffix != ".ts":
        packet = b"\0\0\1".join([b"", packet[4:]])
    kinds = [packet[k + 3] for k in range(len(packet) - 3) if packet[k : k + 3] == b"\0\0\1"]
    return next((kind & 0x60 == 0 for kind in kinds if kind & 0x1F in (1, 5)), False)


def test_a_missing_picture_behind_one_with_its_number_is_told(tmp_path: Path) -> None:
    # The decoder compares a number with that of the picture before, also if no other picture depends on that one.
    path = tmp_path / "clip.mp4"
    options = {**KINDS["pyramid"], "x264-params": "b-adapt=0:scenecut=0"}
    truth = coded(path, **options)
    with av.open(str(path)) as container:
        packets = [bytes(packet) for packet in container.demux(video=0) if packet.size]
    is_needed = [not _hangs_nothing_on(packet, ".mp4") for packet in packets]
    behind = [k for k in range(2, 20) if is_needed[k] and not is_needed[k - 1]]
    assert len(behind) > 2
    for k in behind:
        assert wrong(without(path, {k}), truth) == [], k


def test_numbers_that_went_once_around_are_not_believed(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    truth = coded(path, g="60", bf="0", sc_threshold="0")
    # No key frame is due there: it is the sixteen numbers that come out the same.
    fewer = without(path, set(range(65, 81)))
    assert wrong(fewer, truth) == []
    assert statuses(fewer) == "." * 65 + "x" * 9


def test_a_lost_key_frame_leaves_the_whole_group_damaged(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    truth = coded(path, g="16", bf="0", sc_threshold="0")
    fewer = without(path, {32})
    assert wrong(fewer, truth) == []
    assert statuses(fewer) == "." * 32 + "x" * 15 + "." * (COUNT - 48)


def test_a_stream_without_key_frames_is_sound_again_once_every_part_was_refreshed(tmp_path: Path) -> None:
    path = tmp_path / "clip.mkv"
    truth = coded(path, g="20", bf="0", **{"x264-params": "intra-refresh=1"})
    fewer = without(path, {24})
    assert wrong(fewer, truth) == []
    found = statuses(fewer)
    assert found.startswith("." * 24 + "x")
    assert found.endswith("." * 20)


def test_frames_that_a_camera_never_coded_are_no_damage(tmp_path: Path) -> None:
    # An uneven rate: the pictures that are there follow one another.
    path = tmp_path / "clip.mkv"
    taken = sorted(int(k) for k in np.random.default_rng(5).choice(200, COUNT, replace=False))
    coded(path, ticks=taken, g="30", bf="0")
    # In the first group nobody knows yet when a key frame is due: a long pause early in it may hide one.
    assert statuses(path)[30:] == "." * (COUNT - 30)


def test_a_camera_that_pauses_does_so_in_the_last_group_too(tmp_path: Path) -> None:
    path = tmp_path / "clip.mkv"
    taken = [k for k in range(COUNT + 5) if k not in (15, 33, 52, 70, COUNT + 2)]
    truth = coded(path, "ffv1", ticks=taken, g="12", level="3", slicecrc="1")
    assert statuses(path) == "." * COUNT
    # Where pictures were lost in another group, they may be in the last one as well.
    assert wrong(without(path, {40, COUNT - 4}), truth) == []


@pytest.mark.parametrize("coder", ["libx265", "mpeg2video"])
def test_other_codecs_tell_of_missing_pictures_too(tmp_path: Path, coder: str) -> None:
    path = tmp_path / "clip.mp4"
    more = {"x265-params": "keyint=20:bframes=3:log-level=none"} if coder == "libx265" else {"g": "20", "bf": "2"}
    truth = coded(path, coder, **more)
    for gone in ({7}, {21, 50}, {40}):
        assert wrong(without(path, gone), truth) == [], gone


def test_damaged_headers_of_a_file_are_told_or_do_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "film.mp4"
    coded(path)
    content = path.read_bytes()
    first = content.index(b"avcC") + 4
    for byte in range(first + 8, first + 24):
        path.write_bytes(content[:byte] + b"\xff" + content[byte + 1 :])
        with suppress(FingervisionError):
            statuses(path)

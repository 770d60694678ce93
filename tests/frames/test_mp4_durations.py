"""An MP4 file with a damaged table of contents: its frames have no time, and never a wrong time."""

import struct
from collections.abc import Callable
from pathlib import Path

import av
import pytest

from fingervision.domain.frame import LostFrame
from fingervision.frames.mp4_durations import NO_SCALE, states_another_duration
from tests.frames.test_damage import COUNT, coded, nothing_wrong

Change = Callable[[bytearray], object]


def flipped(box: bytes, at: int, bit: int) -> Change:
    """Flip a bit of a box, `at` bytes after its name."""

    def change(content: bytearray) -> None:
        content[content.rindex(box) + 4 + at] ^= 1 << bit

    return change


def overwritten(box: bytes, at: int, new: bytes) -> Change:
    def change(content: bytearray) -> None:
        begin = content.rindex(box) + 4 + at
        content[begin : begin + len(new)] = new

    return change


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mp4") / "clip.mp4"
    coded(path, "libx264", g="12", bf="2", preset="ultrafast")
    return path


@pytest.mark.parametrize(
    "change",
    [
        *(flipped(b"mdhd", at, bit) for at, bit in ((13, 0), (14, 1), (14, 4))),  # ticks a second
        *(flipped(b"stts", at, bit) for at, bit in ((14, 0), (15, 3))),  # duration of a picture
        flipped(b"stts", 11, 0),  # how many pictures have it
        overwritten(b"stsz", 12, b"\x85\x37\xb0\x44"),  # a size beyond all: FFmpeg reads no further
        overwritten(b"edts", 0, bytes(8)),  # the edit list under another name
        overwritten(b"elst", 4, b"\xff\xff\xff\xff"),  # more rows than there are
    ],
)
def test_no_time_is_wrong(clip: Path, change: Change) -> None:
    found, timed = nothing_wrong(clip, change)
    assert timed == 0
    first = found[0]
    assert isinstance(first, LostFrame)
    assert first.words == NO_SCALE


def test_of_a_sound_file_every_time_is_believed(clip: Path) -> None:
    found, timed = nothing_wrong(clip, lambda _: None)
    assert (len(found), timed) == (COUNT, COUNT)


@pytest.mark.parametrize("coder", ["ffv1", "mjpeg"])
def test_coders_that_keep_the_order_are_believed(tmp_path: Path, coder: str) -> None:
    path = tmp_path / "clip.mp4"
    if coder == "ffv1" and av.__version__.startswith("14."):
        pytest.skip("PyAV 14 writes no FFV1 into MP4")
    coded(path, coder, g="1")
    assert not states_another_duration(path)


@pytest.mark.parametrize("cut_ms", [41, 83, 133, 500, 870, 2000])
def test_a_film_that_was_cut_keeps_its_times(clip: Path, tmp_path: Path, cut_ms: int) -> None:
    content = bytearray(clip.read_bytes())
    at = content.rindex(b"elst") + 12
    (shown_ms,) = struct.unpack_from(">I", content, at)
    struct.pack_into(">I", content, at, shown_ms - cut_ms)
    path = tmp_path / "cut.mp4"
    path.write_bytes(content)
    assert not states_another_duration(path)

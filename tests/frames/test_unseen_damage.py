"""VP8 without a checksum: if damage was noticed anywhere, no frame of the file is passed on as undamaged."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fingervision.domain.frame import Frame, LostFrame
from tests.frames.test_damage import COUNT, packets, read
from tests.frames.test_matroska_checksums import recorded


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("vp8") / "clip.webm", "libvpx")


def changed(clip: Path, path: Path, change: Callable[[bytearray, int], object]) -> list[Frame | LostFrame]:
    """Change the file at the packet in its middle, and read it."""
    content = bytearray(clip.read_bytes())
    change(content, content.index(packets(clip)[COUNT // 2]))
    path.write_bytes(content)
    return read(path)


def too_long(content: bytearray, at: int) -> None:
    """Let the frame tag announce a first partition longer than the packet (RFC 6386, 9.1)."""
    content[at : at + 3] = bytes((content[at] | 0xE0, 0xFF, 0xFF))


def cut_out(content: bytearray, at: int) -> None:
    del content[at + 5 : at + 300]


@pytest.mark.parametrize("change", [too_long, cut_out])
def test_no_frame_is_given_where_damage_was_noticed(
    clip: Path, tmp_path: Path, change: Callable[[bytearray, int], object]
) -> None:
    found = changed(clip, tmp_path / "changed.webm", change)
    lost = [item for item in found if isinstance(item, LostFrame)]
    assert found
    assert len(lost) == len(found)
    assert any("VP8 has no checksums" in item.words for item in lost)


def test_a_missing_end_or_beginning_is_no_such_damage(clip: Path, tmp_path: Path) -> None:
    found = changed(clip, tmp_path / "end.webm", lambda content, at: content.__delitem__(slice(at + 40, None)))
    assert sum(isinstance(item, Frame) for item in found) >= COUNT // 2 - 1
    assert isinstance(found[-1], LostFrame)
    assert all(isinstance(item, Frame) for item in read(clip))

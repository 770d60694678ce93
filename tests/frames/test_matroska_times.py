"""A cluster with a damaged time: its frames have no time, and never a wrong time."""

from pathlib import Path

import pytest

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.matroska_times import CLUSTER, CUES
from tests.frames.test_damage import COUNT, coded, nothing_wrong

TIMESTAMP = b"\xe7"


def leapt(changed: bytearray, cluster: int, by_ms: int) -> None:
    """Change the time of a cluster by one flipped bit."""
    at = -1
    for _ in range(cluster + 1):
        at = changed.index(CLUSTER, at + 1)
    at = changed.index(TIMESTAMP, at)
    begin, end = at + 2, at + 2 + (changed[at + 1] & 0x7F)
    changed[begin:end] = (int.from_bytes(changed[begin:end], "big") ^ by_ms).to_bytes(end - begin, "big")


@pytest.mark.parametrize("by_ms", [8, 64, 512, 4096])
@pytest.mark.parametrize("coder", ["ffv1", "libx264"])
def test_frames_of_a_cluster_whose_time_leaps_have_none(tmp_path: Path, coder: str, by_ms: int) -> None:
    path = tmp_path / "clip.mkv"
    coded(path, coder, g="12", **({"bf": "2"} if coder == "libx264" else {"level": "3", "slicecrc": "1"}))
    found, whole = nothing_wrong(path, lambda changed: leapt(changed, 1, by_ms))
    said = [item for item in found if isinstance(item, LostFrame)]
    assert len(said) == 1
    assert "cluster" in said[0].words
    without = [item for item in found if isinstance(item, Frame) and item.time_s is None]
    assert 0 < len(without) < COUNT / 2 + 12
    assert whole + len(without) == COUNT


def test_without_an_index_clusters_that_overlap_are_not_believed(tmp_path: Path) -> None:
    path = tmp_path / "clip.mkv"
    coded(path, "ffv1", g="12", level="3", slicecrc="1")

    def change(changed: bytearray) -> None:
        leapt(changed, 1, 512)
        at = changed.rindex(CUES)
        changed[at:] = b"\xec" + bytes(len(changed) - at - 1)  # an empty element
        changed[at + 1] = 0x80

    found, whole = nothing_wrong(path, change)
    assert any(isinstance(item, LostFrame) and "cluster" in item.words for item in found)
    assert whole >= COUNT - 3 * 12


@pytest.mark.parametrize("coder", ["ffv1", "libx264", "mjpeg"])
def test_of_a_sound_file_every_time_is_believed(tmp_path: Path, coder: str) -> None:
    path = tmp_path / "clip.mkv"
    coded(path, coder, g="12", **({"bf": "3"} if coder == "libx264" else {}))
    found, whole = nothing_wrong(path, lambda changed: None)
    assert (len(found), whole) == (COUNT, COUNT)

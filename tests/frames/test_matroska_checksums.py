"""Checksums of Matroska clusters: for a codec without own checksums, the cluster is lost no wrong picture shown."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.frames.source_kinds import open_source
from fingervision.frames.unchecked_codecs import CLUSTER
from tests.clips import Codec, coded
from tests.frames.test_damage import COUNT, RATE_HZ, film, nothing_wrong, packets, read

OPTIONS = {"g": "12", "b": "300k", "deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}


def recorded(path: Path, coder: str) -> Path:
    coded(path, film(), Codec(coder, "yuv420p", OPTIONS), rate_hz=RATE_HZ)
    return path


@pytest.mark.parametrize("coder", ["libvpx", "libvpx-vp9"])
def test_every_flip_of_a_picture_is_seen(tmp_path: Path, coder: str) -> None:
    path = recorded(tmp_path / "clip.mkv", coder)
    content = path.read_bytes()
    rng = np.random.default_rng(3)
    coded = packets(path)
    for frame in rng.choice(np.arange(5, COUNT - 5), 6, replace=False):
        at = content.index(coded[frame]) + int(rng.integers(1, len(coded[frame])))
        _, whole = nothing_wrong(path, lambda changed, at=at: changed.__setitem__(at, changed[at] ^ 16))  # type: ignore[misc]
        assert COUNT - 3 * 12 <= whole < COUNT


@pytest.mark.parametrize("where", [0, 1, 5])
def test_a_checksum_that_is_itself_damaged_costs_its_cluster(tmp_path: Path, where: int) -> None:
    path = recorded(tmp_path / "clip.mkv", "libvpx")

    def change(changed: bytearray) -> None:
        second = changed.index(CLUSTER, changed.index(CLUSTER) + 1)
        changed[changed.index(b"\xbf\x84", second) + where] ^= 2

    _, whole = nothing_wrong(path, change)
    assert COUNT - 3 * 12 <= whole < COUNT


def test_who_has_no_checksum_is_told_so(tmp_path: Path) -> None:
    with_checksums, without = (recorded(tmp_path / f"clip{suffix}", "libvpx") for suffix in (".mkv", ".webm"))
    assert not any("checksum" in note for note in open_source(str(with_checksums)).description.notes)
    notes = [note for note in open_source(str(without)).description.notes if "checksum" in note]
    assert len(notes) == 1
    assert "vp8" in notes[0]
    assert all(isinstance(item, Frame) for path in (with_checksums, without) for item in read(path))

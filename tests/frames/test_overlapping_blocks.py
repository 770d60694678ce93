"""A Matroska block that reaches into the next one stands where damage has moved it: its bytes are no picture."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.frames.source_kinds import open_source

SIZE_PX, FRAMES, MOVED = (160, 120), 6, 3
CLUSTER = bytes.fromhex("1F43B675")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Raw video without checksums, each picture in a cluster of its own."""
    path = tmp_path / "raw.mkv"
    rng = np.random.default_rng(3)
    with av.open(str(path), "w", options={"write_crc32": "0", "cluster_size_limit": "1000"}) as container:
        stream = container.add_stream("rawvideo", rate=25)
        stream.width, stream.height, stream.pix_fmt = *SIZE_PX, "gray"
        for k in range(FRAMES):
            levels = rng.integers(0, 255, SIZE_PX[::-1], dtype=np.uint8)
            picture = av.VideoFrame.from_ndarray(levels, format="gray")
            picture.pts, picture.time_base = k, Fraction(1, 25)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


def pictures(path: Path) -> dict[float, np.ndarray]:
    return {item.time_s: item.pixels for item in open_source(str(path)) if isinstance(item, Frame) and item.time_s}


def test_a_block_that_reaches_into_the_next_one_gives_no_picture(recording: Path) -> None:
    sound = pictures(recording)
    assert len(sound) == FRAMES - 1  # the first one is at 0 s
    content = recording.read_bytes()
    starts = [at for at in range(len(content) - 4) if content.startswith(CLUSTER, at)]
    assert len(starts) == FRAMES
    begin = starts[MOVED]
    data = content.index(sound[MOVED / 25].tobytes(), begin)
    head, behind = content[begin:data], data + 5000
    recording.write_bytes(content[:begin] + content[data:behind] + head + content[behind:])
    found = pictures(recording)
    assert MOVED / 25 not in found
    for time_s, levels in found.items():
        np.testing.assert_array_equal(levels, sound[time_s])

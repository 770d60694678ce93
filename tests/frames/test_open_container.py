"""Names and metadata that the text rules of FFmpeg and Python would refuse."""

from pathlib import Path

import av
import pytest

from fingervision.frames.open_container import open_container
from fingervision.frames.source_kinds import open_source
from tests.clips import h264, write_clip
from tests.frames.test_video_file import smooth_pictures, timed


@pytest.mark.parametrize("suffix", [".mkv", ".mp4"])
def test_a_title_that_is_no_text_costs_no_frame(tmp_path: Path, suffix: str) -> None:
    write_clip(tmp_path / f"clip{suffix}", timed(smooth_pictures(4)), h264())
    path = tmp_path / f"titled{suffix}"
    with open_container(tmp_path / f"clip{suffix}") as old, av.open(str(path), "w") as new:
        new.metadata["title"] = "Spalt 7"
        stream = new.add_stream_from_template(old.streams.video[0], opaque=True)
        for packet in old.demux(video=0):
            if packet.size:
                packet.stream = stream
                new.mux(packet)
    content = path.read_bytes()
    assert b"Spalt 7" in content
    whole = len(list(open_source(str(path))))
    assert whole >= 3  # PyAV 14 loses the last picture when it copies an MP4
    path.write_bytes(content.replace(b"Spalt 7", b"Sp\xe4lt 7"))
    assert len(list(open_source(str(path)))) == whole

"""Videos of phones state a rotation: the frames are measured as a player shows them."""

import shutil
import subprocess
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.frames.source_kinds import open_source

FFMPEG = shutil.which("ffmpeg")
HEIGHT, WIDTH = 48, 64


def picture(number: int) -> NDArray[np.uint8]:
    """A picture whose four quarters all differ."""
    out = np.full((HEIGHT, WIDTH), 40, dtype=np.uint8)
    out[: HEIGHT // 2, : WIDTH // 2] = 200
    out[: HEIGHT // 2, WIDTH // 2 :] = 120
    out[5, number] = 255
    return out


def turn(stream: av.VideoStream, rotation_deg: int) -> None:
    if not hasattr(stream, "set_display_rotation"):
        pytest.skip(f"PyAV {av.__version__} writes no turned recordings")
    stream.set_display_rotation(rotation_deg)


def recorded(path: Path, rotation_deg: int) -> Path:
    with av.open(path, "w") as container:
        stream = container.add_stream("ffv1", rate=Fraction(25))
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "gray"
        turn(stream, rotation_deg)
        for number in range(3):
            for packet in stream.encode(av.VideoFrame.from_ndarray(picture(number), format="gray")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
    return path


@pytest.mark.parametrize("rotation_deg", [0, 90, 180, -90])
def test_pictures_stand_as_the_file_asks(tmp_path: Path, rotation_deg: int) -> None:
    path = recorded(tmp_path / "phone.mkv", rotation_deg)
    source = open_source(str(path))
    frames = list(source)
    turned = rotation_deg % 180 != 0
    assert (source.description.width_px, source.description.height_px) == (
        (HEIGHT, WIDTH) if turned else (WIDTH, HEIGHT)
    )
    assert any("rotated by" in note for note in source.description.notes) is (rotation_deg != 0)
    for number, frame in enumerate(frames):
        assert isinstance(frame, Frame)
        assert np.array_equal(frame.pixels, np.rot90(picture(number), rotation_deg // 90))


@pytest.mark.skipif(FFMPEG is None, reason="ffmpeg is not installed.")
@pytest.mark.parametrize("rotation_deg", [90, 180, -90])
def test_they_stand_as_another_player_shows_them(tmp_path: Path, rotation_deg: int) -> None:
    path = recorded(tmp_path / "phone.mkv", rotation_deg)
    assert FFMPEG is not None
    shown = subprocess.run(
        [FFMPEG, "-v", "error", "-i", str(path), "-frames:v", "1", "-f", "rawvideo", "-pix_fmt", "gray", "-"],
        check=True,
        capture_output=True,
    ).stdout
    first = next(iter(open_source(str(path))))
    assert isinstance(first, Frame)
    assert np.array_equal(np.frombuffer(shown, dtype=np.uint8).reshape(first.pixels.shape), first.pixels)


def test_an_odd_angle_is_said_and_left_alone(tmp_path: Path) -> None:
    source = open_source(str(recorded(tmp_path / "tilted.mkv", 30)))
    (first, *_) = list(source)
    assert isinstance(first, Frame)
    assert np.array_equal(first.pixels, picture(0))
    assert any("not a multiple of 90 degrees" in note for note in source.description.notes)

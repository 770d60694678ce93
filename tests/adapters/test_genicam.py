"""GenICam cameras by harvesters, on Viky: the simulated camera of the GenICam reference implementation."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("harvesters", reason="the extra `genicam` is not installed")

import genicam

import fingervision as fv
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames import genicam as adapter
from fingervision.frames.source import CameraWish, Wish
from fingervision.frames.source_kinds import open_source

PRODUCER = Path(genicam.__file__).parent / "viky.cti"
NAME = f"genicam:{PRODUCER}"
pytestmark = pytest.mark.skipif(not PRODUCER.is_file(), reason="this GenICam comes without its simulated camera")


def some(name: str, count: int, wish: Wish | None = None) -> tuple[object, list[Frame | LostFrame]]:
    source = open_source(name, wish)
    frames = []
    for item in source:
        frames.append(item)
        if len(frames) == count:
            source.close()
    return source.description, frames


def test_frames_come_in_grey_levels_with_rising_times_and_stop_when_closed() -> None:
    described, frames = some(NAME, 4, Wish(rate_hz=40.0))
    assert described.kind == "camera (GenICam)"
    assert described.codec == "Mono8"
    assert described.rate_hz == pytest.approx(40.0)
    assert [item.index for item in frames] == list(range(4))
    assert all(isinstance(item, Frame) for item in frames)
    assert {item.pixels.shape for item in frames} == {(described.height_px, described.width_px)}
    assert all(a.time_s < b.time_s for a, b in pairwise(frames))


def test_pictures_are_copies_of_their_own() -> None:
    """The producer reuses its buffers. Viky's ball moves, so that two pictures must differ in memory and content."""
    _, frames = some(NAME, 8, Wish(rate_hz=50.0))
    assert not any(np.shares_memory(a.pixels, b.pixels) for a, b in pairwise(frames))
    assert any(not np.array_equal(a.pixels, frames[0].pixels) for a in frames[1:])


def test_one_of_several_cameras_is_chosen_by_its_serial_number() -> None:
    described, frames = some(f"{NAME}#1", 1)
    assert len(frames) == 1
    assert described.name.endswith("#1")
    with pytest.raises(fv.DeviceError, match=r"7.*0, 1, 2"):
        open_source(f"{NAME}#7")


def test_what_the_camera_does_not_take_is_said() -> None:
    described, _ = some(NAME, 1, Wish(camera=CameraWish(exposure_ms=2.0, gain=3.0)))
    assert [note.split(" = ")[0].rpartition(" ")[2] for note in described.notes] == ["ExposureTime", "Gain"]


def test_the_python_interface_measures_its_next_frames() -> None:
    measured = fv.measure(NAME, px_per_mm=30.0, frames=2)
    assert len(measured) == 2
    assert all(row.gap_mm is None for row in measured), "a bouncing ball has no gap"


def test_a_producer_that_is_none_is_said(tmp_path: Path) -> None:
    with pytest.raises(fv.InputFileError, match=r"nothing\.cti"):
        open_source(f"genicam:{tmp_path}/nothing.cti")
    (tmp_path / "text.cti").write_text("no library")
    with pytest.raises(fv.DeviceError, match=r"text\.cti"):
        open_source(f"genicam:{tmp_path}/text.cti")


def test_a_picture_without_all_of_its_packets_is_damaged() -> None:
    source = open_source(NAME)
    received = source.received()
    next(received)

    class Part:
        data = np.zeros(7, np.uint8)

    class Buffer:
        payload = type("Payload", (), {"components": [Part()]})
        module = type("Module", (), {"is_complete": True})

    item = source._item(Buffer(), 3, 1.0)
    assert isinstance(item, LostFrame)
    assert item.status is Status.DAMAGED
    source.close()
    assert list(received) == []


def test_deep_levels_keep_their_depth() -> None:
    grey = np.arange(12, dtype=np.uint16) * 300
    copied = adapter.levels(grey, (3, 4))
    assert copied.dtype == np.uint16
    assert not np.shares_memory(copied, grey)
    np.testing.assert_array_equal(copied.ravel(), grey)

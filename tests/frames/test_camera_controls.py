"""Settings that drivers allow to change while a camera runs: OpenCV's backends, V4L2's limits, GenICam's features."""

from pathlib import Path
from typing import Any

import cv2
import pytest

from fingervision.frames import genicam
from fingervision.frames.camera import LAYOUT, control_list, ranges, request_of
from fingervision.frames.camera_settings import MSMF, READ, V4L2
from fingervision.frames.controls import CameraControl
from tests.frames.test_camera_settings import EXPOSURE, MediaFoundationCamera, UsbCamera


def test_of_v4l2_values_and_limits_are_milliseconds() -> None:
    camera = UsbCamera()
    read = {what: camera.get(what) for what in READ}
    found = {each.name: each for each in control_list(V4L2, read, {EXPOSURE: (1, 5000), cv2.CAP_PROP_GAIN: (0, 255)})}
    assert list(found) == ["exposure", "gain", "focus", "white balance", "frame rate"]
    assert found["exposure"] == CameraControl("exposure", 15.700000000000001, "ms", 0.1, 500.0)
    assert (found["gain"].least, found["gain"].greatest, found["focus"].least) == (0.0, 255.0, None)
    camera.values[cv2.CAP_PROP_AUTO_EXPOSURE] = 1.0  # as it was opened
    camera.set(*request_of(V4L2, "exposure", 8.0))
    assert camera.values[EXPOSURE] == 80.0
    camera.set(*request_of(V4L2, "frame rate", 15.0))
    assert camera.values[cv2.CAP_PROP_FPS] == 15.0


def test_of_media_foundation_an_exposure_is_a_power_of_two() -> None:
    camera = MediaFoundationCamera()
    read = {what: camera.get(what) for what in READ}
    found = {each.name: each for each in control_list(MSMF, read, {})}
    assert found["exposure"].value == pytest.approx(31.25)
    assert "gain" not in found
    assert "frame rate" not in found
    camera.set(*request_of(MSMF, "exposure", 8.0))
    assert camera.values[EXPOSURE] == -7.0


def test_a_backend_that_lets_nothing_be_set_has_no_controls() -> None:
    assert control_list("AVFOUNDATION", {EXPOSURE: 1.0}, {}) == ()


def test_limits_are_asked_of_the_driver(tmp_path: Path) -> None:
    device = tmp_path / "video0"
    device.write_bytes(b"")
    stated = {0x009A0902: (3, 2047, 0), 0x00980913: (0, 100, 1), 0x009A090A: (5, 5, 0)}

    def ioctl(_: int, request: int, question: bytes) -> bytes:
        assert (request, len(question)) == (0xC0445624, 68)
        number = int.from_bytes(question[:4], "little")
        if number not in stated:
            raise OSError(22, "Invalid argument")
        least, greatest, flags = stated[number]
        return LAYOUT.pack(number, 1, b"a control", least, greatest, 1, least, flags)

    # The second is disabled, the third has one value alone, the fourth is not there.
    assert ranges(str(device), ioctl) == {EXPOSURE: (3, 2047)}
    assert ranges(str(tmp_path / "video9"), ioctl) == {}
    assert ranges(str(device)) == {}  # a file is no camera


class Node:
    def __init__(self, value: float, least: float, greatest: float) -> None:
        self.value, self.min, self.max = value, least, greatest


def test_of_genicam_features_are_in_our_units() -> None:
    class Nodes:
        ExposureTime = Node(10000.0, 20.0, 1e6)
        AcquisitionFrameRate = Node(30.0, 1.0, 163.0)

        @property
        def Gain(self) -> Any:  # noqa: N802 - the standard's name
            raise RuntimeError("AccessException")

    assert genicam.control_list(Nodes()) == (
        CameraControl("exposure", 10.0, "ms", 0.02, 1000.0),
        CameraControl("frame rate", 30.0, "Hz", 1.0, 163.0),
    )

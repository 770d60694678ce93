"""Requested and reported settings of cameras, tested with simulated cameras that behave like OpenCV's backends."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from fingervision.domain.errors import DeviceError, UsageError
from fingervision.domain.frame import Coding
from fingervision.frames.camera import CameraFrames
from fingervision.frames.camera_settings import MSMF, READ, V4L2, Settled, coding_of, requests, settled
from fingervision.frames.source import CameraWish, Wish

YUYV, MJPG = (float(cv2.VideoWriter.fourcc(*letters)) for letters in ("YUYV", "MJPG"))
AUTO, EXPOSURE, FOCUS = cv2.CAP_PROP_AUTO_EXPOSURE, cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_FOCUS
WISH = Wish(25.0, (640, 480), CameraWish("YUYV", exposure_ms=8.0, gain=0.0, focus=30.0, white_balance_k=4600.0))


class UsbCamera:
    """A simulated V4L2 camera with steps and limits, -1 for properties that it lacks, and all automatic modes on at
    first.
    """

    def __init__(self, *, formats: tuple[float, ...] = (MJPG, YUYV), stubborn: bool = False, lacks: int = -1) -> None:
        self.formats, self.stubborn, self.lacks = formats, stubborn, lacks
        self.values: dict[int, float] = {
            cv2.CAP_PROP_FOURCC: formats[0],
            cv2.CAP_PROP_FPS: 30.0,
            EXPOSURE: 157.0,
            cv2.CAP_PROP_GAIN: 64.0,
            FOCUS: 51.0,
            cv2.CAP_PROP_TEMPERATURE: 5000.0,
            cv2.CAP_PROP_ZOOM: 100.0,
            AUTO: 3.0,
            cv2.CAP_PROP_AUTOFOCUS: 1.0,
            cv2.CAP_PROP_AUTO_WB: 1.0,
        }

    def get(self, what: int) -> float:
        return -1.0 if what == self.lacks else self.values.get(what, -1.0)

    def set(self, what: int, value: float) -> None:
        if what == cv2.CAP_PROP_FOURCC:
            value = value if value in self.formats else self.formats[0]
        elif what == FOCUS:
            value = min(250.0, 5.0 * round(value / 5.0))
        elif what == AUTO and (self.stubborn or value not in (1.0, 3.0)):
            return
        elif what == EXPOSURE and self.values[AUTO] != 1.0:
            return  # a driver refuses a value while the automatic is on
        self.values[what] = value


class MediaFoundationCamera:
    """A simulated Media Foundation camera: setting an automatic mode also changes the value, and a mode is always read
    as 0.
    """

    def __init__(self) -> None:
        self.values: dict[int, float] = {EXPOSURE: -5.0, FOCUS: 40.0, cv2.CAP_PROP_TEMPERATURE: 5000.0}
        self.automatic = {EXPOSURE: True, FOCUS: True, cv2.CAP_PROP_TEMPERATURE: True}

    def get(self, what: int) -> float:
        return 0.0 if what in (AUTO, cv2.CAP_PROP_AUTOFOCUS) else self.values.get(what, -1.0)

    def set(self, what: int, value: float) -> None:
        target = {AUTO: EXPOSURE, cv2.CAP_PROP_AUTOFOCUS: FOCUS}.get(what, what)
        if target in self.values:
            self.values[target] = float(int(value))
            self.automatic[target] = what != target and value != 0.0


def set_up(camera: UsbCamera | MediaFoundationCamera, wish: Wish, backend: str) -> Settled:
    for what, value in requests(backend, wish, {what: camera.get(what) for what in READ}):
        camera.set(what, value)
    return settled(backend, wish, {what: camera.get(what) for what in READ})


def test_a_camera_that_does_as_asked_gets_one_sentence_with_all_that_it_reads_back() -> None:
    camera = UsbCamera()
    found = set_up(camera, WISH, V4L2)
    assert camera.values[EXPOSURE] == 80.0  # steps of 0.1 ms
    assert found.notes == (
        "The camera reports these settings: format YUYV, exposure 8 ms, gain 0, focus 30, white balance 4600 K, zoom "
        "100.",
    )


def test_what_nobody_asks_for_stays_and_no_longer_changes_by_itself() -> None:
    camera = UsbCamera()
    found = set_up(camera, Wish(), V4L2)
    assert (camera.values[EXPOSURE], camera.values[FOCUS]) == (157.0, 51.0)
    assert [camera.values[what] for what in (AUTO, cv2.CAP_PROP_AUTOFOCUS, cv2.CAP_PROP_AUTO_WB)] == [1.0, 0.0, 0.0]
    assert found.settings["exposure"] == "15.7 ms"
    assert len(found.notes) == 1


@pytest.mark.parametrize(
    ("camera", "change", "sentence"),
    [
        (UsbCamera(), {"focus": 32.0}, "The camera's focus was requested as 32, but is 30."),
        (UsbCamera(), {"focus": 900.0}, "The camera's focus was requested as 900, but is 250."),
        (UsbCamera(), {"exposure_ms": 0.02}, "The camera's exposure was requested as 0.02 ms, but is 0.1 ms."),
        (UsbCamera(formats=(MJPG,)), {}, "The format YUYV was requested from the camera, but it gives MJPG."),
        (UsbCamera(formats=(MJPG,)), {}, "The camera compresses its pictures (MJPG) with loss"),
        (UsbCamera(lacks=FOCUS), {}, "The camera's focus was requested as 30, but the camera has no such setting."),
        (
            UsbCamera(stubborn=True),
            {},
            "The camera's automatic exposure could not be switched off (the camera reports the mode 3): edges",
        ),
    ],
)
def test_what_a_camera_does_otherwise_is_said(camera: UsbCamera, change: dict[str, float], sentence: str) -> None:
    wish = replace(WISH, camera=replace(WISH.camera, **change))  # type: ignore[arg-type]
    assert any(note.startswith(sentence) for note in set_up(camera, wish, V4L2).notes)


def test_another_rate_is_said() -> None:
    wish = Wish(rate_hz=60.0)
    assert (
        "60 frames per second was requested from the camera, but it states 30"
        in settled(V4L2, wish, {cv2.CAP_PROP_FPS: 30.0}).notes[0]
    )
    assert (
        "60 frames per second was requested from the camera, but it states no rate" in settled(V4L2, wish, {}).notes[0]
    )


@pytest.mark.parametrize(("value", "automatic"), [(1.0, False), (0.25, False), (3.0, True), (0.75, True), (0.0, True)])
def test_both_menus_of_automatic_exposure_are_understood(value: float, automatic: bool) -> None:
    found = settled(V4L2, Wish(), {AUTO: value, EXPOSURE: 100.0})
    assert found.settings["exposure"] == ("automatic" if automatic else "10 ms")


def test_media_foundation_counts_exposure_in_powers_of_two_and_is_held_by_writing_values() -> None:
    camera = MediaFoundationCamera()
    found = set_up(camera, Wish(camera=CameraWish(exposure_ms=8.0)), MSMF)
    assert camera.values == {EXPOSURE: -7.0, FOCUS: 40.0, cv2.CAP_PROP_TEMPERATURE: 5000.0}
    assert not any(camera.automatic.values())
    assert found.notes[0] == "The camera's exposure was requested as 8 ms, but is 7.812 ms."
    assert found.settings["white balance"] == "5000 K"


def test_avfoundation_is_asked_for_size_and_rate_alone_and_the_rest_is_said() -> None:
    asked = dict(requests("AVFOUNDATION", replace(WISH, camera=CameraWish(exposure_ms=8.0)), {}))
    assert set(asked) == {cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FPS}
    found = settled("AVFOUNDATION", Wish(camera=CameraWish(exposure_ms=8.0)), dict.fromkeys(READ, 0.0))
    assert found.notes[0] == (
        "The camera's exposure was requested as 8 ms, but AVFOUNDATION does not allow programs to change this "
        "setting: change it in the camera's own program."
    )
    assert set(found.settings) == {"format"}


@pytest.mark.parametrize(
    ("wish", "sentence"),
    [
        ({"format": "raw"}, "--format must be four letters, such as YUYV or MJPG, but is 'raw'."),
        ({"exposure_ms": 0.0}, "--exposure-ms must be positive, but is 0."),
        ({"white_balance_k": float("nan")}, "--white-balance-k must be positive, but is nan."),
        ({"gain": float("inf")}, "--gain must be a number, but is inf."),
    ],
)
def test_what_no_camera_has_is_refused(wish: Mapping[str, str | float], sentence: str) -> None:
    with pytest.raises(UsageError) as refused:
        CameraWish(**wish)  # type: ignore[arg-type]
    assert str(refused.value) == sentence


def test_what_is_no_camera_is_refused_and_opencv_keeps_its_words_to_itself(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    device = tmp_path / "video0"
    device.touch()
    with pytest.raises(DeviceError, match=f"The camera {device} cannot be opened: another program uses it"):
        CameraFrames(str(device), Wish())
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("pixel_format", "coding"),
    [("YUYV", Coding.LOSSLESS), ("MJPG", Coding.INTRAFRAME), ("H264", Coding.INTERFRAME), ("GREY", Coding.LOSSLESS)],
)
def test_a_camera_that_compresses_is_lossy(pixel_format: str, coding: Coding) -> None:
    assert coding_of({"format": pixel_format}) is coding


def test_a_camera_that_says_nothing_counts_as_raw() -> None:
    assert coding_of({}) is Coding.LOSSLESS

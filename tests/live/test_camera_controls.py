"""Exposure, gain, focus and frame rate while a camera runs, with a plug-in camera that declares its settings."""

import json
import time
from collections.abc import Callable, Iterator
from functools import cache
from itertools import count
from pathlib import Path
from threading import Event, Thread, get_ident
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from calib.calibration import BareScale
from fingervision.domain.errors import DeviceError, FingervisionError, StateError
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.frames.controls import CameraControl, adjust, controls_of
from fingervision.frames.source import Description, Received
from fingervision.live.capture import Adjustments, Capture
from fingervision.live.choices import Choices
from fingervision.live.commands import obey, section
from fingervision.live.commands.camera import CameraError
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.rendering import Camera, render, two_fingers
from tests.live.browser import browser, opened, shown
from tests.live.test_wrong_fields import TWENTY
from tests.waiting import until

__all__ = ["browser", "opened"]


@cache
def picture() -> NDArray[np.uint8]:
    scene = two_fingers(60.0, below_tip_px=10.2, width_px=60.0, frame=(320, 240))
    return render(scene, Camera(noise_grey=1.0), np.random.default_rng(2)).astype(np.uint8)


class PluginCamera:
    """A simulated camera whose light depends on its exposure; steps of 0.5 ms, a gain that does not change, a focus
    that fails.
    """

    has_own_clock, template = True, None

    def __init__(self) -> None:
        self._closed = Event()
        self.values = {"exposure": 10.0, "gain": 1.0, "focus": 30.0, "frame rate": 100.0}
        self.threads: set[int] = set()
        self.is_cut = self.is_stuck = False

    @property
    def description(self) -> Description:
        told = {name: f"{value:g}" for name, value in self.values.items()}
        height_px, width_px = picture().shape
        return Description(
            "bench", "camera of a plug-in", "none", Coding.LOSSLESS, width_px, height_px, None, True, None, camera=told
        )

    def controls(self) -> tuple[CameraControl, ...]:
        self.threads.add(get_ident())
        return (
            CameraControl("exposure", self.values["exposure"], "ms", 0.5, 20.0),
            CameraControl("gain", self.values["gain"]),
            CameraControl("focus", self.values["focus"], "", 0.0, 250.0),
            CameraControl("frame rate", self.values["frame rate"], "Hz", 1.0, 100.0),
        )

    def set_control(self, name: str, value: float) -> None:
        if name == "gain":
            return
        if name == "focus" and value == 13.0:
            raise OSError("VIDIOC_S_CTRL: Input/output error")
        self.values[name] = 0.5 * round(2.0 * value) if name == "exposure" else value

    def received(self) -> Iterator[Received]:
        for index in count():
            if self._closed.wait(0.02):
                return
            if self.is_cut:
                raise DeviceError("The camera was unplugged.")
            while self.is_stuck:
                time.sleep(0.01)
            pixels = (picture() * min(1.0, self.values["exposure"] / 10.0)).astype(np.uint8)
            yield Received(Frame(pixels, index, 0.02 * index), time.monotonic())

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        return (each.item for each in self.received())

    def close(self) -> None:
        self._closed.set()


class AllControls(PluginCamera):
    """A simulated camera on which all five settings can be changed."""

    def __init__(self) -> None:
        super().__init__()
        self.values["white balance"] = 5000.0

    def controls(self) -> tuple[CameraControl, ...]:
        return (*super().controls(), CameraControl("white balance", self.values["white balance"], "K", 2800.0, 6500.0))


@pytest.fixture
def cameras() -> list[PluginCamera]:
    return [PluginCamera(), PluginCamera()]


@pytest.fixture
def session(tmp_path: Path, cameras: list[PluginCamera]) -> Iterator[Session]:
    capture = Capture(cameras[0], again=lambda: cameras[1])
    found = Session(capture, Choices(scale=BareScale(34.0)), tmp_path / "out")
    found.start()
    until(lambda: found.history.count > 3)
    yield found
    found.stop()


def put(session: Session, name: str, value: object) -> str:
    return obey(session, {"do": "set_camera", "name": name, "value": value}).words


def told(session: Session) -> dict[str, float]:
    return {each["name"]: each["value"] for each in section(session)["camera_controls"]}


def brightest(session: Session) -> int:
    assert session.seen is not None
    return int(session.seen.frame.pixels.max())


def test_a_value_is_taken_read_back_and_seen_in_the_picture(session: Session, cameras: list[PluginCamera]) -> None:
    assert told(session) == {"exposure": 10.0, "gain": 1.0, "focus": 30.0, "frame rate": 100.0}
    before = brightest(session)
    assert put(session, "exposure", 5) == "The camera's exposure was 10 ms and is 5 ms from now on."
    assert told(session)["exposure"] == 5.0
    until(lambda: brightest(session) < 0.6 * before)
    assert "is 4.5 ms from now on (4.3 ms was requested)" in put(session, "exposure", 4.3)
    # The driver is touched by the thread alone that reads it, after the main one opened it.
    assert cameras[0].threads <= {get_ident(), session.capture._thread.ident}


REFUSED: tuple[tuple[str, object, str], ...] = (
    ("exposure", 0.1, "must be 0.5 to 20 ms, but is 0.1"),
    ("exposure", 1e9, "must be 0.5 to 20 ms, but is 1e+09"),
    ("exposure", -3, "must be a positive number, but is -3"),
    ("exposure", None, "value must be a number, but is empty"),
    ("exposure", "8 ms", "value must be a number, but is '8 ms'"),
    ("exposure", True, "value must be a number"),
    ("exposure", float("nan"), "value must be a number"),
    ("exposure", 10**5000, "value must be a number, but is too large"),
    ("frame rate", 0, "must be a positive number, but is 0"),
    ("frame rate", 1e6, "must be 1 to 100 Hz"),
    ("gain", 3, "was set to gain 3, but stays at 1"),
    ("focus", 13, "refused to set focus 13 (OSError: VIDIOC_S_CTRL"),
    ("focus", 251, "must be 0 to 250, but is 251"),
    ("shutter", 1, "can be changed while this camera runs (exposure, gain, focus, frame rate), but is 'shutter'"),
    ("", 1, "name must be a text"),
    ("<script>" * 200, 1, "name must be a text"),
)


def test_what_a_camera_does_not_take_is_a_sentence_beside_its_field(session: Session) -> None:
    before = told(session)
    for name, value, words in REFUSED:
        with pytest.raises(FingervisionError) as refused:
            put(session, name, value)
        assert words in str(refused.value), str(refused.value)
        if 0 < len(name) < 20:
            assert refused.value.field == name  # type: ignore[attr-defined]
    assert told(session) == before
    measured = session.history.count
    until(lambda: session.history.count > measured)


@pytest.mark.parametrize("name", ["exposure", "gain", "focus", "white balance", "frame rate"])
def test_twenty_wrong_things_in_every_field_of_a_camera_change_nothing(name: str, tmp_path: Path) -> None:
    camera = AllControls()
    session = Session(Capture(camera, again=None), Choices(scale=BareScale(34.0)), tmp_path)
    session.start()
    until(lambda: session.history.count > 3)
    before, settings = dict(camera.values), session.choices
    for wrong in (*TWENTY, 1e9):
        with pytest.raises(FingervisionError) as refused:
            put(session, name, wrong)
        words = str(refused.value)
        assert words.endswith("."), words
        assert len(words) < 400, words
        assert refused.value.field == name  # type: ignore[attr-defined]
    assert camera.values == before
    assert session.choices == settings
    measured = session.history.count
    until(lambda: session.history.count > measured)
    session.stop()


def test_a_change_during_a_recording_stands_in_its_events_and_focus_waits(session: Session) -> None:
    put(session, "exposure", 8.0)
    run = session.record()
    until(lambda: session.recording is not None and session.recording.run.frames > 3)
    put(session, "exposure", 6.0)
    with pytest.raises(CameraError, match="end the recording first"):
        put(session, "focus", 60.0)
    session.stop_recording()
    events = [json.loads(line) for line in (run / "events.jsonl").read_text().splitlines()]
    changes = [each for each in events if each["event"] == "camera"]
    assert [each["words"] for each in changes] == ["The camera's exposure was 8 ms and is 6 ms from now on."]
    assert changes[0]["time_s"] > 0.0
    about = json.loads((run / "run.json").read_text())
    assert about["device"]["camera"]["exposure"] == "8"
    assert "is 60 from now on" in put(session, "focus", 60.0)
    assert any("calibrate again" in each.words for each in session.messages)


def test_a_camera_that_comes_back_gets_what_was_chosen(session: Session, cameras: list[PluginCamera]) -> None:
    put(session, "exposure", 5.0)
    cameras[0].is_cut = True
    until(lambda: session.capture.source is cameras[1])
    until(lambda: cameras[1].values["exposure"] == 5.0)
    assert told(session)["exposure"] == 5.0


def test_a_camera_that_is_silent_says_so_and_is_not_changed_later(
    session: Session, cameras: list[PluginCamera], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fingervision.live.capture.ANSWERED_WITHIN_S", 0.2)
    cameras[0].is_stuck = True
    time.sleep(0.05)
    with pytest.raises(CameraError, match="does not answer, so that its exposure was not changed"):
        put(session, "exposure", 5.0)
    cameras[0].is_stuck = False
    measured = session.history.count
    until(lambda: session.history.count > measured + 3)
    assert cameras[0].values["exposure"] == 10.0


def test_a_source_without_controls_has_none() -> None:
    with pytest.raises(StateError, match="no settings"):
        Adjustments().ask("exposure", 1.0)


class Faulty(PluginCamera):
    """A driver whose list of settings raises an error, or contains something else than settings."""

    def __init__(self, found: object) -> None:
        super().__init__()
        self.found = found

    def controls(self) -> tuple[CameraControl, ...]:
        if isinstance(self.found, Exception):
            raise self.found
        return self.found  # type: ignore[return-value]


@pytest.mark.parametrize(
    "found", [RuntimeError("driver"), None, 3, ("exposure",), (CameraControl("exposure", float("nan"), "ms"),)]
)
def test_a_driver_that_fails_to_say_what_it_has_takes_nothing_with_it(found: object) -> None:
    assert controls_of(Faulty(found)) == ()


def test_a_driver_that_forgets_a_setting_says_so() -> None:
    class Forgets(PluginCamera):
        def set_control(self, name: str, value: float) -> None:
            self.controls = lambda: ()  # type: ignore[method-assign]

    with pytest.raises(DeviceError, match="no longer reports its"):
        adjust(Forgets(), "exposure", 5.0)


@pytest.mark.slow
def test_the_page_sets_the_camera_and_refuses_beside_the_field(session: Session, opened: Callable[..., Any]) -> None:
    page = Page(session, bound("127.0.0.1", 0))
    end = Event()
    Thread(target=page.serve, args=(end,), daemon=True).start()
    try:
        seen = opened(page.address, viewport={"width": 390, "height": 844})
        shown(seen, "document.querySelectorAll('#camera_controls form').length === 4")
        seen.evaluate("document.querySelector('#set_up').open = true")
        seen.fill("#camera_0", "900")
        seen.get_by_role("button", name="Set exposure").click()
        shown(seen, "document.querySelector('#camera_words_0').textContent.includes('0.5 to 20 ms, but is 900')")
        seen.fill("#camera_0", "4.3")
        seen.get_by_role("button", name="Set exposure").click()
        shown(seen, "document.querySelector('#camera_0').value === '4.5'")
        assert seen.locator("#camera_words_0").inner_text() == ""
        assert seen.evaluate("document.documentElement.scrollWidth") <= 390
        looking = opened(page.viewer_address)
        shown(looking, "document.querySelector('#camera_0') && document.querySelector('#camera_0').disabled")
    finally:
        end.set()

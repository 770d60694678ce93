"""Interrupted sources: every interruption is reported, no earlier data are lost, and the measurement continues."""

import socket
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from itertools import count, groupby, pairwise
from pathlib import Path
from threading import Event, Thread
from time import monotonic

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Coding, Frame
from fingervision.frames import camera
from fingervision.frames.camera_settings import V4L2
from fingervision.frames.source import Description, Received, Wish
from fingervision.frames.source_kinds import open_source
from fingervision.live import capture as capture_module
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.opening import opened
from fingervision.live.session import Session
from fingervision.measuring.measure import measure
from fingervision.measuring.task import Task
from fingervision.rendering import Camera, render, two_fingers
from tests.waiting import until

SIZE_PX, SCALE = (160, 120), BareScale(17.0)
WITHIN_S = 120.0
PICTURES = 20


def picture(gap_px: float = 60.0, seed: int = 0) -> np.ndarray:
    scene = two_fingers(gap_px, below_tip_px=5.1, width_px=25.0, frame=SIZE_PX)
    return np.asarray(render(scene, Camera(noise_grey=1.0), np.random.default_rng(seed)))


class CutCamera:
    """Server of JPEG pictures over HTTP that disconnects in the middle of a picture, after a given number per
    connection.
    """

    def __init__(self, pictures: int) -> None:
        self._parts = [self._part(k) for k in range(pictures)]
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{self._listening.getsockname()[1]}/feed.mjpg"
        Thread(target=self._serve, daemon=True).start()

    def _part(self, number: int) -> bytes:
        """One picture, whose gap equals its number."""
        coded = cv2.imencode(".jpg", picture(40.0 + number), [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()
        return b"--x\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%b\r\n" % (len(coded), coded)

    def _serve(self) -> None:
        while True:
            try:
                client, _ = self._listening.accept()
            except OSError:
                return
            with client, suppress(OSError):
                client.recv(4096)
                client.sendall(b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=x\r\n\r\n")
                for part in self._parts:
                    client.sendall(part)
                    time.sleep(0.02)
                client.sendall(self._parts[0][: len(self._parts[0]) // 2])

    def close(self) -> None:
        self._listening.close()


@pytest.mark.slow
def test_a_stream_that_is_cut_twenty_times_comes_back_twenty_times_and_loses_nothing(tmp_path: Path) -> None:
    served = CutCamera(PICTURES)
    session = Session(opened(served.address, Wish()), Choices(SCALE), tmp_path)
    said: Counter[str] = Counter()
    session.on_message.append(lambda message: said.update([message.name]))
    session.start()
    run = session.record()
    until(lambda: said["resumed"] >= 20)
    session.stop()
    served.close()
    assert said["interrupted"] - said["resumed"] in (0, 1)
    assert said["recording_failed"] == 0
    # A connection's first pictures go to finding out what it is; from there to the cut every one is measured.
    found = [round(row.gap_px - 40.0) for row in session.rows(0, session.row_count) if row.gap_px is not None]
    whole = [list(group) for _, group in groupby(enumerate(found), key=lambda each: each[1] - each[0])]
    numbers = [[number for _, number in group] for group in whole]
    assert [each[-1] for each in numbers[:-1]] == [PICTURES - 1] * (len(numbers) - 1)
    assert len(numbers) >= 19  # the first is over when the measurement is ready, and the last has just begun
    assert all(each[0] <= 4 for each in numbers[1:])
    again = measure(open_source(str(run / "video.mp4")), Task(SCALE), tmp_path / "again")
    assert again.series.counts["ok"] > 0
    assert (tmp_path / "again" / "gaps.csv").read_text() == (run / "gaps.csv").read_text()


class Plug:
    """A replacement of OpenCV's capture that fails as if the camera were unplugged."""

    plugged = Event()
    gain = 10.0

    def __init__(self, *_: object) -> None:
        self._open = self.plugged.is_set()
        self._pixels = cv2.cvtColor(picture(), cv2.COLOR_GRAY2BGR)

    def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
        return self._open

    def read(self) -> tuple[bool, np.ndarray | None]:
        time.sleep(0.01)
        self._open = self._open and self.plugged.is_set()
        return (True, self._pixels.copy()) if self._open else (False, None)

    def getBackendName(self) -> str:  # noqa: N802 - OpenCV's name
        return V4L2

    def get(self, what: int) -> float:
        return {cv2.CAP_PROP_GAIN: self.gain, cv2.CAP_PROP_FPS: 100.0}.get(what, -1.0)

    def set(self, what: int, value: float) -> bool:
        return True

    def release(self) -> None:
        self._open = False


@pytest.fixture
def plug(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[Plug]]:
    def check(name: str) -> None:
        if not Plug.plugged.is_set():
            raise FingervisionError(f"There is no camera {name}.")

    monkeypatch.setattr(camera.cv2, "VideoCapture", Plug)
    monkeypatch.setattr(camera, "_check_device", check)
    monkeypatch.setattr(Plug, "gain", 10.0)
    Plug.plugged.set()
    yield Plug
    Plug.plugged.clear()


def test_a_camera_that_is_unplugged_comes_back_and_says_so(tmp_path: Path, plug: type[Plug]) -> None:
    session = Session(opened("/dev/video7", Wish()), Choices(SCALE), tmp_path)
    session.start()
    run, earlier = session.record(), session.row_count
    said: list[tuple[str, str]] = []
    session.on_message.append(lambda message: said.append((message.name, message.words)))
    until(lambda: session.row_count > 5)
    plug.plugged.clear()
    until(lambda: any(name == "interrupted" for name, _ in said))
    before = session.row_count
    assert "is it plugged in?" in said[-1][1]
    until(lambda: session.silent_s > 0.0)
    plug.gain = 20.0  # it forgot its settings
    plug.plugged.set()
    until(lambda: session.row_count > before + 5)
    session.stop()
    names = [name for name, _ in said]
    assert names.index("interrupted") < names.index("camera") < names.index("resumed")
    times_s = [row.time_s for row in session.rows(0, session.row_count) if row.time_s is not None]
    assert max(after - one for one, after in pairwise(times_s)) > 0.25  # the time away is a gap, and no more is lost
    assert len((run / "gaps.csv").read_text().splitlines()) >= session.row_count - earlier - 1


def test_a_camera_that_comes_back_with_another_size_is_not_measured(
    tmp_path: Path, plug: type[Plug], monkeypatch: pytest.MonkeyPatch
) -> None:
    session = Session(opened("/dev/video7", Wish()), Choices(SCALE), tmp_path)
    session.start()
    until(lambda: session.row_count > 2)
    plug.plugged.clear()
    until(lambda: session.silent_s > 0.0)
    before = session.row_count
    other = np.zeros((240, 320, 3), np.uint8)
    monkeypatch.setattr(plug, "read", lambda self: (time.sleep(0.01), True, other)[1:])
    plug.plugged.set()
    until(lambda: any(message.name == "changed" for message in session.messages))
    assert session.row_count == before
    session.stop()


class JumpingClock:
    """A camera whose own clock is set forward by an hour and back by ten seconds during operation."""

    has_own_clock = True
    template = None
    jumps = {30: 3600.0, 60: -10.0}  # noqa: RUF012 - never changed

    def __init__(self, frames: int) -> None:
        self._frames = frames
        self._pixels = picture()
        self.description = Description("jumping", "camera", "raw", Coding.LOSSLESS, *SIZE_PX, 100.0, True, None)

    def received(self) -> Iterator[Received]:
        time_s = 1000.0
        for index in range(self._frames):
            time_s += 0.01 + self.jumps.get(index, 0.0)
            time.sleep(0.01)
            yield Received(Frame(self._pixels, index, time_s, Coding.LOSSLESS), monotonic())

    def close(self) -> None:
        """The source is not open."""


def test_a_clock_that_jumps_is_said_and_moves_no_frame(tmp_path: Path) -> None:
    session = Session(Capture(JumpingClock(90), again=None), Choices(SCALE), tmp_path)
    said: list[str] = []
    session.on_message.append(lambda message: said.append(message.name))
    session.start()
    run = session.record()
    assert session.ended.wait(WITHIN_S)
    session.stop()
    assert said.count("time_jumped") == 2
    rows = list(session.rows(0, session.row_count))
    assert [row.frame for row in rows] == list(range(90))
    times_s = [row.time_s for row in rows if row.time_s is not None]
    assert all(after > one for one, after in pairwise(times_s))
    assert times_s[-1] - times_s[0] < 60.0  # neither an hour, nor backwards
    again = measure(open_source(str(run / "video.mp4")), Task(SCALE), tmp_path / "again")
    assert again.series.counts["ok"] > 0
    assert (tmp_path / "again" / "gaps.csv").read_text() == (run / "gaps.csv").read_text()


def test_a_fault_of_a_driver_is_a_cut_and_no_silent_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture_module, "AGAIN_AFTER_S", 0.01)
    numbers = count()

    class Faulty(JumpingClock):
        jumps: dict[int, float] = {}  # noqa: RUF012 - never changed

        def received(self) -> Iterator[Received]:
            if next(numbers) < 3:
                raise RuntimeError("ioctl failed")
            yield from super().received()

    session = Session(Capture(Faulty(10_000), again=lambda: Faulty(10_000)), Choices(SCALE), tmp_path)
    session.start()
    until(lambda: session.row_count > 3)
    session.stop()
    assert sum("ioctl failed" in message.words for message in session.messages) == 3

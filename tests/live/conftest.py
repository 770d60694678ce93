"""Live views as processes, a network camera that ffmpeg plays, and a browser."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import cos, pi
from pathlib import Path
from threading import Event, Thread
from typing import Any

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.frames.source import Wish
from fingervision.live.choices import Choices
from fingervision.live.opening import opened
from fingervision.live.playback.playback import Playback
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.rendering import Camera, render, two_fingers
from tests.csv_rows import csv_rows
from tests.waiting import free_port

# It is for the system's Python.
collect_ignore = ["rtsp_server.py"]
# Starting Python with its libraries takes seconds where two cores are shared by many.
START_S = 120.0
CYCLE = 50
PX_PER_MM = 34.0
JPEG_BEGINS = b"\xff\xd8\xff"


@dataclass
class Live:
    """A running `fingervision live`."""

    process: subprocess.Popen[str]
    out: Path
    stdout: Path
    stderr: Path

    def text(self) -> str:
        return self.stdout.read_text() + self.stderr.read_text()

    def lines(self) -> list[dict[str, Any]]:
        whole = self.stdout.read_text().rpartition("\n")[0]
        return [json.loads(line) for line in whole.splitlines() if line.startswith("{")]

    def until(self, found: Callable[["Live"], Any], within_s: float = START_S) -> Any:
        end_s = time.monotonic() + within_s
        while time.monotonic() < end_s:
            if value := found(self):
                return value
            assert self.process.poll() is None, self.text()
            time.sleep(0.05)
        raise AssertionError(f"not within {within_s} s: {self.text()[-2000:]}")

    @property
    def address(self) -> str:
        found = self.until(lambda live: re.search(r"http://\S+token=\S+", live.text()))
        return str(found[0])

    def stop(self, how: signal.Signals = signal.SIGINT) -> int:
        if self.process.poll() is None:
            self.process.send_signal(how)
        return self.process.wait(START_S)

    def runs(self) -> list[Path]:
        return sorted(path.parent for path in self.out.glob("*/gaps.csv"))


@dataclass
class NetworkCamera:
    """ffmpeg that serves MJPEG over HTTP to one client at a time."""

    pictures: Path
    port: int
    rate_hz: int = 25
    coding: tuple[str, ...] = ("-c", "copy", "-f", "mpjpeg")
    process: subprocess.Popen[bytes] | None = field(default=None)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/feed.mjpg"

    def start(self) -> None:
        command = ["ffmpeg", "-loglevel", "quiet", "-re", "-stream_loop", "-1", "-framerate", str(self.rate_hz)]
        command += ["-i", str(self.pictures), *self.coding, "-listen", "1", self.address]
        self.process = subprocess.Popen(command)
        end_s = time.monotonic() + START_S
        while not is_listened_at(self.port):
            assert time.monotonic() < end_s, f"ffmpeg does not listen within {START_S} s"
            time.sleep(0.02)
            if self.process.poll() is not None:  # another connection had this port for a moment, and ffmpeg gave up
                self.process = subprocess.Popen(command)

    def stop(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()


def is_listened_at(port: int) -> bool:
    """Whether a server listens on the port, or serves a client there.

    No connection is made, because ffmpeg only serves its first client. A live view that waits for its camera may be
    that client as soon as ffmpeg listens, and ffmpeg then listens no more.
    """
    connections = Path("/proc/net/tcp")
    if connections.is_file():
        rows = [line.split() for line in connections.read_text(encoding="ascii").splitlines()[1:]]
        # Own address and state of each connection, in hexadecimal digits; 01 is established, 0A is listening.
        return any(int(row[1].split(":")[1], 16) == port and row[3] in ("01", "0A") for row in rows)
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind(("127.0.0.1", port))
        except OSError:
            return True
    return False


@pytest.fixture
def live(tmp_path: Path) -> Iterator[Callable[..., Live]]:
    """Start live views, and end all of them after the test."""
    started: list[Live] = []

    def start(*arguments: str | Path, out: Path | None = None, name: str = "live") -> Live:
        number = len(started)
        folder = out or tmp_path / f"out{number}"
        stdout, stderr = tmp_path / f"stdout{number}", tmp_path / f"stderr{number}"
        command = [sys.executable, "-m", "fingervision", name, *map(str, arguments), "--out", str(folder)]
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[2])}
        with stdout.open("w") as first, stderr.open("w") as second:
            process = subprocess.Popen(command, stdout=first, stderr=second, text=True, env=environment, cwd=tmp_path)
        started.append(Live(process, folder, stdout, stderr))
        return started[-1]

    yield start
    for each in started:
        if each.process.poll() is None:
            each.process.kill()
            each.process.wait()


@pytest.fixture(scope="session")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """JPEG pictures of a moving gripper, one after the other."""
    path = tmp_path_factory.mktemp("camera") / "gripper.mjpeg"
    rng = np.random.default_rng(3)
    with path.open("wb") as file:
        for index in range(CYCLE):
            scene = two_fingers(PX_PER_MM * (2.5 - 1.5 * cos(2 * pi * index / CYCLE)), radius_px=20.0)
            picture = render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng)
            file.write(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes())
    return path


def single_pictures(pictures: Path) -> list[bytes]:
    """Divide a sequence of JPEG pictures at their start marker, which does not occur within a picture."""
    return [JPEG_BEGINS + rest for rest in pictures.read_bytes().split(JPEG_BEGINS)[1:]]


@pytest.fixture
def camera(pictures: Path) -> Iterator[NetworkCamera]:
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed: it plays the network camera.")
    found = NetworkCamera(pictures, free_port())
    found.start()
    yield found
    found.stop()


@pytest.fixture
def rows() -> Callable[[Path], list[dict[str, str]]]:
    def read(path: Path) -> list[dict[str, str]]:
        return csv_rows(path)

    return read


@pytest.fixture
def measured(tmp_path: Path) -> Callable[..., str]:
    """Measure a recording, and return its gaps.csv as text."""

    def measure(video: Path, *options: str | Path) -> str:
        out = tmp_path / f"measured_{video.parent.name}"
        command = [sys.executable, "-m", "fingervision", "measure", str(video), *map(str, options), "--out", str(out)]
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[2])}
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        assert (out / "gaps.csv").exists(), done.stderr
        return (out / "gaps.csv").read_text()

    return measure


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(opened("simulated", Wish()), Choices(scale=BareScale(PX_PER_MM)), tmp_path)


@pytest.fixture
def page(session: Session) -> Iterator[Page]:
    with serving(session) as found:
        yield found


@contextmanager
def serving(view: Session | Playback) -> Iterator[Page]:
    found, ending = Page(view, bound("127.0.0.1", 0)), Event()
    thread = Thread(target=found.serve, args=(ending,))
    thread.start()
    try:
        yield found
    finally:
        ending.set()
        thread.join()

"""An RTSP camera on loopback, served by GStreamer: its own clock, its own packets, cut and restored."""

import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.live.conftest import CYCLE, START_S, free_port, single_pictures

SCALE = ("--px-per-mm", "34")
SYSTEM_PYTHON = "/usr/bin/python3"
HAS_GSTREAMER = "import gi; gi.require_version('GstRtspServer', '1.0'); from gi.repository import GstRtspServer"
SERVER = Path(__file__).parent / "rtsp_server.py"
CUT_S = 2.0
# RTP's clock has 90 000 ticks a second; each end of a step is rounded to microseconds too.
CLOCK_TICK_S = 1.5e-5


class RtspCamera:
    def __init__(self, pictures: str, count: int) -> None:
        self._pictures, self._count, self._port = pictures, count, free_port()
        self.address = f"rtsp://127.0.0.1:{self._port}/camera"
        self.start()

    def start(self) -> None:
        arguments = [str(SERVER), str(self._port), self._pictures, str(self._count)]
        self._process = subprocess.Popen([SYSTEM_PYTHON, *arguments], stderr=subprocess.DEVNULL)

    def wait(self) -> None:
        end_s = time.monotonic() + START_S
        while time.monotonic() < end_s:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self._port)):
                return
            time.sleep(0.05)

    def stop(self) -> None:
        self._process.kill()
        self._process.wait()


@pytest.fixture
def rtsp_camera(pictures: Path, tmp_path: Path) -> Iterator[RtspCamera]:
    try:
        subprocess.run([SYSTEM_PYTHON, "-c", HAS_GSTREAMER], capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("the system's Python has no GstRtspServer: it plays the RTSP camera.")
    for index, picture in enumerate(single_pictures(pictures)):
        (tmp_path / f"{index:03d}.jpg").write_bytes(picture)
    camera = RtspCamera(str(tmp_path / "%03d.jpg"), CYCLE)
    camera.wait()
    yield camera
    camera.stop()


@pytest.mark.slow
def test_an_rtsp_camera_keeps_its_clock_and_comes_back_after_a_cut(
    live: Callable[..., Any],
    rtsp_camera: RtspCamera,
    measured: Callable[..., str],
    rows: Callable[[Path], list[dict[str, str]]],
) -> None:
    view = live(rtsp_camera.address, *SCALE, "--no-page", "--json")
    view.until(lambda seen: len(seen.lines()) > 30)
    rtsp_camera.stop()
    view.until(lambda seen: f"The stream {rtsp_camera.address} is cut off" in seen.text())
    before = len(view.lines())
    time.sleep(CUT_S)
    rtsp_camera.start()
    view.until(lambda seen: "The source is back" in seen.text() and len(seen.lines()) > before + 25)
    assert view.stop() == 0

    lines = view.lines()
    assert {line["status"] for line in lines} == {"ok"}
    steps = [after["time_s"] - line["time_s"] for line, after in pairwise(lines)]
    (cut,) = (index for index, step in enumerate(steps) if step > CUT_S)
    whole = [*steps[:cut], *steps[cut + 1 :]]
    assert whole == pytest.approx([0.04] * len(whole), abs=CLOCK_TICK_S)

    (run,) = view.runs()
    assert len(rows(run / "gaps.csv")) == len(lines)
    assert measured(run / "video.mp4", *SCALE) == (run / "gaps.csv").read_text()

"""An RTSP camera on the loopback interface, served by GStreamer: clock, packets, interruption and restoration."""

import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.network_stream import NetworkStream
from tests.live.conftest import CYCLE, START_S, single_pictures
from tests.waiting import free_port

SCALE = ("--px-per-mm", "34")
SYSTEM_PYTHON = "/usr/bin/python3"
HAS_GSTREAMER = "import gi; gi.require_version('GstRtspServer', '1.0'); from gi.repository import GstRtspServer"
SERVER = Path(__file__).parent / "rtsp_server.py"
CUT_S = 2.0
# RTP's clock has 90 000 ticks a second; each end of a step is rounded to microseconds too.
CLOCK_TICK_S = 1.5e-5


class RtspCamera:
    def __init__(self, pictures: str, count: int, coder: str = "jpeg", lost: float = 0.0) -> None:
        self._pictures, self._count, self._port = pictures, count, free_port()
        self._how = [coder, str(lost)]
        self.address = f"rtsp://127.0.0.1:{self._port}/camera"
        self.start()

    def start(self) -> None:
        arguments = [str(SERVER), str(self._port), self._pictures, str(self._count), *self._how]
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
def rtsp_camera(pictures: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[RtspCamera]:
    """An RTSP camera whose codec and share of lost packets are parameters of the test."""
    try:
        subprocess.run([SYSTEM_PYTHON, "-c", HAS_GSTREAMER], capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("the system's Python has no GstRtspServer: it plays the RTSP camera.")
    for index, picture in enumerate(single_pictures(pictures)):
        (tmp_path / f"{index:03d}.jpg").write_bytes(picture)
    camera = RtspCamera(str(tmp_path / "%03d.jpg"), CYCLE, *getattr(request, "param", ()))
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
    view.until(lambda seen: f"The stream {rtsp_camera.address} is interrupted" in seen.text())
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


@pytest.mark.slow
@pytest.mark.parametrize("rtsp_camera", [("frames", 0.05)], indirect=True, ids=["frames"])
def test_a_picture_that_the_camera_never_sent_makes_no_wrong_one(rtsp_camera: RtspCamera, pictures: Path) -> None:
    # No sequence number is missing and no packet is incomplete: the numbers of the pictures alone tell.
    drawn = [cv2.imdecode(np.frombuffer(one, np.uint8), cv2.IMREAD_GRAYSCALE) for one in single_pictures(pictures)]
    items = list(islice(NetworkStream(rtsp_camera.address), 150))
    assert any(isinstance(item, LostFrame) for item in items)
    # Fingers move by ten pixels and more from picture to picture: what hangs on another one shows both.
    rough = [
        min(float(np.abs(item.pixels - one.astype(float)).max()) for one in drawn)
        for item in items
        if isinstance(item, Frame)
    ]
    assert len(rough) > 20
    assert max(rough) < 40.0


def has_lost(lines: list[dict[str, Any]]) -> bool:
    steps = [after["time_s"] - line["time_s"] for line, after in pairwise(lines)]
    return any(line["status"] != "ok" for line in lines) or max(steps) > 0.06


@pytest.mark.slow
@pytest.mark.parametrize("rtsp_camera", [("h264", 0.01), ("jpeg", 0.002)], indirect=True, ids=["h264", "jpeg"])
def test_the_recording_of_a_camera_that_loses_packets_measures_to_the_live_table(
    live: Callable[..., Any],
    rtsp_camera: RtspCamera,
    measured: Callable[..., str],
    rows: Callable[[Path], list[dict[str, str]]],
) -> None:
    view = live(rtsp_camera.address, *SCALE, "--no-page", "--json")
    # Of JPEG a picture that is not whole never comes; of H.264 it comes as damaged.
    view.until(lambda seen: len(seen.lines()) > 100 and has_lost(seen.lines()))
    assert view.stop() == 0
    (run,) = view.runs()
    table = rows(run / "gaps.csv")
    assert measured(run / "video.mp4", *SCALE) == (run / "gaps.csv").read_text()
    # The gripper moves between 1 and 4 mm, by no more than 0.2 mm in a frame: what is `ok` follows it.
    found = [(float(row["time_s"]), float(row["gap_mm"])) for row in table if row["status"] == "ok"]
    assert len(found) > 20
    assert all(0.95 < gap_mm < 4.05 for _, gap_mm in found)
    for (time_s, gap_mm), (after_s, after_mm) in pairwise(found):
        assert abs(after_mm - gap_mm) < 0.2 * max(1.0, (after_s - time_s) / 0.04) + 0.02

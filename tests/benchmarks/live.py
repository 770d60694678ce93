"""Live measuring of a network camera on loopback: frames lost, lateness, processor, memory.

    python -m tests.benchmarks.live [--seconds 600] [--size 640x480] [--rate-hz 25] [--record] [--page] [--viewers 4]
        [--rtsp] [--busy 2] [--colour] [--wall] [--json]

ffmpeg serves MJPEG over HTTP (grey, or with --colour 4:4:4), or with --rtsp GStreamer H.264 over RTSP; with --busy so
many other processes reckon without end; with --wall the fingers have side walls of 2 px in view (448x320), which are
learnt together with the camera and take longest; with --json the figures are printed for programs. Capture and
measuring run in this process, as `fingervision live` runs them. It ends by itself. Each line is a figure, with its bar
where it has one.

* lost: frames that arrived and were not measured, and frames that are missing between two that arrived;
* expected: frames that ffmpeg's pace gives in the time between the first and the last;
* late: from arrival to number;
* core: processor time of this process, as a share of one core (decoding, measuring, watching);
* alarms: what the page would show in red at any time;
* memory: resident, after a tenth of the time (the first minute of ten) and at the end.

With --page somebody looks: the page is served and each picture acknowledged, by a process of its own; the longest that
any of them waited for a new picture is printed (2 s without one is a page that stands still). With --viewers so many
look on by the other address, and one more that sleeps (its process is stopped while pictures come).
"""

import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from math import cos, pi
from pathlib import Path
from threading import Event, Thread

import cv2
import numpy as np

from calib.calibration import BareScale
from fingervision.domain.errors import DeviceError
from fingervision.frames.source import Wish
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.opening import opened
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.rendering import Camera, render, two_fingers
from fingervision.storage.gaps_csv import GapRow
from tests.benchmarks.camera_artefacts.optics import Surface
from tests.benchmarks.frame import Namespace, benchmark, told
from tests.benchmarks.unknown_cameras import CURVES, drawn, lossless

ASLEEP_AFTER_S, BEGINS_WITHIN_S = 5.0, 30.0
CYCLE, PX_PER_MM, WALL_PX = 50, 34.0, 2.0
MOST_CORE, MOST_GROWN_MB = 0.25, 10.0
JPEG_BEGINS = b"\xff\xd8\xff"
SERVER = Path(__file__).parents[1] / "live" / "rtsp_server.py"
# GStreamer's bindings are the system's.
SYSTEM_PYTHON = "/usr/bin/python3"
BUSY = "while True: pass"
# What a page does: take each message and acknowledge it. What stands before the picture names its frame: the same
# picture sent again is no new one. The page says "no picture" after half a second; four times as long stands still.
FROZEN_S = 2.0
LOOKS = """
import json, struct, sys, time
from urllib.parse import urlsplit
from websockets.sync.client import connect
at, seen, came_s, longest_s = urlsplit(sys.argv[1]), None, None, 0.0
with connect(f"ws://{at.netloc}/socket?{at.query}", origin=f"http://{at.netloc}", max_size=None) as page:
    for message in page:
        if isinstance(message, bytes):
            (length,) = struct.unpack(">I", message[:4])
            frame = (json.loads(message[4 : 4 + length])["now"] or {}).get("frame")
            now_s = time.monotonic()
            if came_s is None or now_s - came_s > 1.1 * longest_s:
                longest_s = now_s - (came_s or now_s)
                print(longest_s, flush=True)
            if len(message) > 4 + length and frame != seen:
                seen, came_s = frame, now_s
            page.send('{"do": "ack"}')
"""


def answering(address: str) -> Capture:
    """Open the camera, which needs some seconds to begin on a busy machine."""
    until_s = time.monotonic() + BEGINS_WITHIN_S
    while True:
        try:
            return opened(address, Wish())
        except DeviceError:
            if time.monotonic() > until_s:
                raise
            time.sleep(0.2)


def mjpeg(pictures: Path, rate_hz: int, address: str) -> list[str]:
    """Command of a camera that sends each picture by itself over HTTP."""
    serving = f"ffmpeg -loglevel quiet -re -stream_loop -1 -framerate {rate_hz} -i {pictures}"
    return [*serving.split(), *f"-c copy -f mpjpeg -listen 1 {address}".split()]


def rtsp(pictures: Path, port: int) -> list[str]:
    """Command of a camera that sends H.264 over RTSP, 25 pictures a second."""
    for index, part in enumerate(pictures.read_bytes().split(JPEG_BEGINS)[1:]):
        (pictures.parent / f"{index:03d}.jpg").write_bytes(JPEG_BEGINS + part)
    pattern = str(pictures.parent / "%03d.jpg")
    return [SYSTEM_PYTHON, str(SERVER), str(port), pattern, str(CYCLE), "h264", "0"]


def run(address: str, folder: Path, wanted: argparse.Namespace) -> None:
    """Measure for the wanted time and print what it cost."""
    session = Session(answering(address), Choices(BareScale(PX_PER_MM)), folder)
    late_s: list[float] = []
    times_s: list[float] = []
    arrived: list[float] = []
    frames: list[int] = []

    def note(row: GapRow, arrived_s: float) -> None:
        late_s.append(time.monotonic() - arrived_s)
        times_s.append(row.time_s or 0.0)
        arrived.append(arrived_s)
        frames.append(row.frame)

    session.on_row.append(note)
    looking = looked_at(session, wanted.viewers) if wanted.page else []
    session.start()
    while len(frames) < 2 * wanted.rate_hz:  # the period is known then, and what ffmpeg had ready has come
        time.sleep(0.1)
    if wanted.record:
        session.record()
    first, used_s, began_s = len(frames), time.process_time(), time.monotonic()
    early_bytes = 0
    alarms = set[str]()
    while time.monotonic() - began_s < wanted.seconds:
        time.sleep(0.5)
        alarms |= {session.supervisor.trouble} - {""}
        if not early_bytes and time.monotonic() - began_s > 0.1 * wanted.seconds:
            early_bytes = resident_bytes()
    core = (time.process_time() - used_s) / (time.monotonic() - began_s)
    last, late_bytes = len(frames) - 1, resident_bytes()
    lost = session.capture.overflowed + session.cadence.missing + (frames[last] - frames[first]) - (last - first)
    load = os.getloadavg()[0]
    waited_s = longest_wait_s(looking[: 1 + wanted.viewers])
    for each in looking:
        each.kill()
        each.wait()
    session.stop()
    expected = (arrived[last] - arrived[first]) * wanted.rate_hz
    period_ms = 1e3 / wanted.rate_hz
    late_ms = 1e3 * np.array(late_s[first : last + 1])
    p50_ms, p99_ms = np.percentile(late_ms, (50, 99))
    if wanted.json:
        figures = {
            "measured": last - first,
            "expected": expected,
            "lost": lost,
            "alarms": sorted(alarms),
            "late_p99_ms": float(p99_ms),
        }
        figures |= {"late_worst_ms": float(late_ms.max()), "core": core, "early_mb": early_bytes / 1e6}
        figures |= {"waited_s": waited_s}
        print(json.dumps(figures | {"late_mb": late_bytes / 1e6, "period_ms": period_ms, "load": load}))
        return
    looked = f", page open, {wanted.viewers} viewers" if wanted.page else ""
    recorded = ", recording" if wanted.record else ""
    print(f"{wanted.size} at {wanted.rate_hz} frames/s for {arrived[last] - arrived[first]:.1f} s{recorded}{looked}")
    told("frames measured, of so many expected", f"{last - first} of {expected:.1f}")
    told("frames lost", f"{lost}", "none", lost == 0)
    told("alarms", " ".join(sorted(alarms)) or "none", "none", not alarms)
    told("late, median", f"{p50_ms:.1f} ms")
    told("late, 99th percentile", f"{p99_ms:.1f} ms", f"a frame, {period_ms:.1f} ms", p99_ms <= period_ms)
    told("late, worst", f"{late_ms.max():.1f} ms")
    if looking:
        told("longest wait of a page for a new picture", f"{waited_s:.2f} s", f"{FROZEN_S:g} s", waited_s <= FROZEN_S)
    told("share of a core", f"{100 * core:.1f} %", f"{100 * MOST_CORE:.0f} %", core <= MOST_CORE)
    grown_mb = (late_bytes - early_bytes) / 1e6
    held = f"{early_bytes / 1e6:.1f} to {late_bytes / 1e6:.1f} MB"
    told("memory", held, f"flat, within {MOST_GROWN_MB:g} MB", grown_mb <= MOST_GROWN_MB)
    told("load of the machine at the end", f"{load:.1f}")


def looked_at(session: Session, viewers: int) -> "list[subprocess.Popen[bytes]]":
    """Serve the page, and look at it from processes of their own; with viewers one of them goes to sleep."""
    page = Page(session, bound("127.0.0.1", 0))
    Thread(target=page.serve, args=(Event(),), daemon=True).start()
    addresses = [page.address, *[page.viewer_address] * (viewers + 1 if viewers else 0)]
    looking = [subprocess.Popen([sys.executable, "-c", LOOKS, at], stdout=subprocess.PIPE) for at in addresses]
    if viewers:
        time.sleep(ASLEEP_AFTER_S)
        looking[-1].send_signal(signal.SIGSTOP)
    return looking


def longest_wait_s(looking: "list[subprocess.Popen[bytes]]") -> float:
    """Return the longest that any page waited for a new picture, until now, and end them."""
    for each in looking:
        each.kill()
    said = [each.communicate()[0].split() for each in looking]
    return max((float(words[-1]) if words else float("inf") for words in said), default=0.0)


def draw(path: Path, width_px: int, height_px: int, *, in_colour: bool, wall: bool) -> None:
    """Write JPEG pictures of a moving gripper, one after the other."""
    rng = np.random.default_rng(3)
    walls = lossless(drawn(3, CYCLE, Surface(wall_px=WALL_PX)), CURVES["linear"]).pictures if wall else ()
    options = [cv2.IMWRITE_JPEG_QUALITY, 92]
    if in_colour:
        options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    with path.open("wb") as file:
        for index in range(CYCLE):
            gap_px = PX_PER_MM * (2.5 - 1.5 * cos(2 * pi * index / CYCLE))
            scene = two_fingers(gap_px, radius_px=20.0, frame=(width_px, height_px))
            picture = walls[index] if wall else render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng)
            picture = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if in_colour else picture
            file.write(cv2.imencode(".jpg", picture, options)[1].tobytes())


def resident_bytes() -> int:
    """Memory of this process that is in use (Linux)."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


@benchmark(
    seconds=600.0,
    size="640x480",
    rate_hz=25,
    record=False,
    page=False,
    viewers=0,
    rtsp=False,
    busy=0,
    colour=False,
    wall=False,
    json=False,
)
def main(wanted: Namespace) -> None:
    """Run once and print the table."""
    width_px, height_px = (int(part) for part in wanted.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        pictures = Path(folder) / "camera.mjpeg"
        draw(pictures, width_px, height_px, in_colour=wanted.colour, wall=wanted.wall)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        address = f"rtsp://127.0.0.1:{port}/camera" if wanted.rtsp else f"http://127.0.0.1:{port}/feed.mjpg"
        serving = rtsp(pictures, port) if wanted.rtsp else mjpeg(pictures, wanted.rate_hz, address)
        others = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(wanted.busy)]
        camera = subprocess.Popen(serving, stderr=subprocess.DEVNULL)
        try:
            run(address, Path(folder), wanted)
        finally:
            for each in (camera, *others):
                each.kill()
                each.wait()

"""Live measuring of a network camera on loopback: frames lost, lateness, processor, memory.

    python tests/benchmarks/live.py [--seconds 600] [--size 640x480] [--rate-hz 25] [--record]

ffmpeg serves MJPEG over HTTP; capture and measuring run in this process, as `fingervision live` runs them.

* lost: frames that arrived and were not measured, and frames that are missing between two that arrived;
* expected: frames that ffmpeg's pace gives in the time between the first and the last;
* late: from arrival to number, in milliseconds and, at the 99th percentile, in frames;
* core: processor time of this process, as a share of one core (decoding, measuring, watching);
* memory: resident, after a tenth of the time and at the end.
"""

import argparse
import socket
import subprocess
import tempfile
import time
from math import cos, pi
from pathlib import Path

import cv2
import numpy as np

from calib.calibration import BareScale
from fingervision.frames.source import Wish
from fingervision.live.choices import Choices
from fingervision.live.opening import opened
from fingervision.live.session import Session
from fingervision.rendering import Camera, render, two_fingers
from fingervision.storage.gaps_csv import GapRow

CYCLE, PX_PER_MM = 50, 34.0


def main() -> None:
    """Run once and print one row."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--rate-hz", type=int, default=25)
    parser.add_argument("--record", action="store_true")
    wanted = parser.parse_args()
    width_px, height_px = (int(part) for part in wanted.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        pictures = Path(folder) / "camera.mjpeg"
        draw(pictures, width_px, height_px)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            address = f"http://127.0.0.1:{free.getsockname()[1]}/feed.mjpg"
        serving = f"ffmpeg -loglevel quiet -re -stream_loop -1 -framerate {wanted.rate_hz} -i {pictures}"
        camera = subprocess.Popen([*serving.split(), *f"-c copy -f mpjpeg -listen 1 {address}".split()])
        try:
            time.sleep(1.0)
            run(address, Path(folder), wanted)
        finally:
            camera.kill()
            camera.wait()


def run(address: str, folder: Path, wanted: argparse.Namespace) -> None:
    """Measure for the wanted time and print what it cost."""
    session = Session(opened(address, Wish()), Choices(BareScale(PX_PER_MM)), folder)
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
    session.start()
    while len(frames) < 2 * wanted.rate_hz:  # compiled code is loaded with the first frames
        time.sleep(0.1)
    if wanted.record:
        session.record()
    first, used_s, began_s = len(frames), time.process_time(), time.monotonic()
    early_bytes = 0
    while time.monotonic() - began_s < wanted.seconds:
        time.sleep(0.5)
        if not early_bytes and time.monotonic() - began_s > 0.1 * wanted.seconds:
            early_bytes = resident_bytes()
    core = (time.process_time() - used_s) / (time.monotonic() - began_s)
    last, late_bytes = len(frames) - 1, resident_bytes()
    lost = session.capture.overflowed + session.cadence.missing + (frames[last] - frames[first]) - (last - first)
    session.stop()
    expected = (arrived[last] - arrived[first]) * wanted.rate_hz
    late_ms = 1e3 * np.array(late_s[first : last + 1])
    p50, p99 = np.percentile(late_ms, (50, 99))
    print("size     rate  seconds  frames expected  lost  late p50 ms  p99 ms  p99 frames  worst ms  core   memory MB")
    print(
        f"{wanted.size:8} {wanted.rate_hz:4d} {arrived[last] - arrived[first]:8.1f} {last - first:7d} {expected:8.1f} "
        f"{lost:5d} {p50:12.2f} {p99:7.2f} {p99 * wanted.rate_hz / 1e3:11.3f} {late_ms.max():9.1f} {100 * core:4.1f}% "
        f"{early_bytes / 1e6:7.1f} -> {late_bytes / 1e6:.1f}"
    )


def draw(path: Path, width_px: int, height_px: int) -> None:
    """Write JPEG pictures of a moving gripper, one after the other."""
    rng = np.random.default_rng(3)
    with path.open("wb") as file:
        for index in range(CYCLE):
            gap_px = PX_PER_MM * (2.5 - 1.5 * cos(2 * pi * index / CYCLE))
            scene = two_fingers(gap_px, radius_px=20.0, frame=(width_px, height_px))
            picture = render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng)
            file.write(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes())


def resident_bytes() -> int:
    """Memory of this process that is in use (Linux)."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


if __name__ == "__main__":
    main()

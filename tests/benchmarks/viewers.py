"""Four pages look at one live view: whether any of them ever stands still.

Run as `python -m tests.benchmarks.viewers [--rate-hz 200] [--seconds 3600] [--viewers 4]` from the top. A simulated
camera runs in a process of its own; each viewer acknowledges what it gets, as the page does. The first viewer works the
page, the others have the address that only looks. Printed for each: messages, new pictures, rows of the history, places
where rows are missing, the longest wait for a message, for a new picture and for a new row, the age of the last picture
at the end, and how often it had to connect; then what the server said of frames that it could not measure, its resident
memory after each tenth of the time, and its share of a core. A viewer has frozen if it ever waited longer than
`FROZEN_S` for a new picture or a new row, also at the end: the exit code is then 1. Messages alone are no proof of
life: a page whose measurement stands still gets five of them a second.
"""

import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from tests.benchmarks.frame import Namespace, benchmark

# The page says "no picture" half a second after the last one (`SILENT_S` of the session): what waits four times as
# long stands still.
FROZEN_S = 2.0
# Before the first rows the server warms up; what comes later counts.
WARM_UP_S = 10.0


@dataclass
class Viewer:
    """What one page saw."""

    messages: int = 0
    pictures: int = 0
    rows: int = 0
    holes: int = 0
    longest_s: float = 0.0
    longest_picture_s: float = 0.0
    longest_row_s: float = 0.0
    connected: int = 0
    came_s: float = 0.0
    picture_s: float = 0.0
    row_s: float = 0.0

    def takes(self, now_s: float, frame: int | None, row: int | None, counted: bool) -> None:
        """Take in a message: the frame of its picture, and its newest row, if it has them."""
        self.messages += 1
        if counted:
            self.waits(now_s)
        self.came_s = now_s
        if frame is not None:
            self.pictures += 1
            self.picture_s = now_s
        if row is not None:
            self.row_s = now_s

    def waits(self, now_s: float) -> None:
        """Note how long it has been waiting."""
        self.longest_s = max(self.longest_s, now_s - self.came_s)
        self.longest_picture_s = max(self.longest_picture_s, now_s - self.picture_s)
        self.longest_row_s = max(self.longest_row_s, now_s - self.row_s)

    @property
    def froze(self) -> bool:
        """Whether it ever stood still."""
        return max(self.longest_picture_s, self.longest_row_s) > FROZEN_S


def look(address: str, until_s: float, seen: Viewer) -> None:
    """Be a page until the time is over."""
    origin = address.partition("/?")[0]
    socket_address = address.replace("http://", "ws://").replace("/?", "/socket?")
    last_frame: int | None = None
    pictured: int | None = None
    began_s = seen.came_s = seen.picture_s = seen.row_s = time.monotonic()
    while time.monotonic() < until_s:
        seen.connected += 1
        try:
            with connect(socket_address, origin=origin, max_size=None) as socket:  # type: ignore[arg-type]
                while time.monotonic() < until_s:
                    content = socket.recv(timeout=30.0)
                    now_s = time.monotonic()
                    (length,) = struct.unpack(">I", content[:4])  # type: ignore[arg-type]
                    head = json.loads(content[4 : 4 + length])
                    newest = None
                    for _, _, _, frame, *_ in head["points"]:
                        seen.rows += 1
                        seen.holes += last_frame is not None and frame > last_frame + 1
                        newest = frame if last_frame is None or frame > last_frame else newest
                        last_frame = frame
                    # The picture's row names its frame: the same picture sent again is no new one.
                    shown = (head["now"] or {}).get("frame") if len(content) > 4 + length else None
                    is_new = shown is not None and shown != pictured
                    pictured = shown if is_new else pictured
                    seen.takes(now_s, shown if is_new else None, newest, now_s > began_s + WARM_UP_S)
                    socket.send('{"do":"ack"}')
        except (ConnectionClosed, TimeoutError, OSError):
            time.sleep(0.5)
    seen.waits(time.monotonic())


@dataclass
class Cost:
    """What the server takes: resident memory after each tenth of the time, and processor time."""

    process: int
    resident_mb: list[float] = field(default_factory=list)
    core_s: float = 0.0

    def watch(self, seconds: float) -> None:
        """Look ten times."""
        ticks = os.sysconf("SC_CLK_TCK")
        for _ in range(10):
            time.sleep(seconds / 10.0)
            about = Path(f"/proc/{self.process}")
            pages = int((about / "statm").read_text().split()[1])
            self.resident_mb.append(pages * os.sysconf("SC_PAGE_SIZE") / 1e6)
            times = (about / "stat").read_text().rpartition(")")[2].split()
            self.core_s = (int(times[11]) + int(times[12])) / ticks


@benchmark(rate_hz=200.0, seconds=3600.0, viewers=4)
def main(chosen: Namespace) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as out:
        command = ["live", "simulated", "--rate-hz", str(chosen.rate_hz), "--port", "0", "--out", str(Path(out) / "o")]
        called = [sys.executable, "-m", "fingervision", *command]
        said = (Path(out) / "said").open("w+")
        live = subprocess.Popen(called, stdout=subprocess.PIPE, stderr=said, text=True)
        assert live.stdout is not None
        found: list[str] = []
        while len(found) < 2:  # the address that works the page, and the one that only looks
            line = live.stdout.readline()
            assert line, "the live view ended before it said where its page is"
            found += re.findall(r"http://\S+", line)
        began_s = time.monotonic()
        until_s = began_s + chosen.seconds
        cost = Cost(live.pid)
        seen = [Viewer() for _ in range(chosen.viewers)]
        addresses = [found[0], *[found[1]] * (chosen.viewers - 1)]
        threads = [Thread(target=look, args=each) for each in zip(addresses, [until_s] * len(seen), seen, strict=True)]
        threads.append(Thread(target=cost.watch, args=(chosen.seconds,)))
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        live.terminate()
        live.wait()
        said.seek(0)
        lost = [int(number) for number in re.findall(r"(\d+) frames? came faster", said.read())]
        said.close()
    print(
        f"{'viewer':>6} {'messages':>9} {'pictures':>9} {'rows':>9} {'holes':>6} {'longest wait, s':>16} "
        f"{'for a picture':>14} {'for a row':>10} {'at the end':>11} {'connected':>10}"
    )
    for number, each in enumerate(seen):
        print(
            f"{number:6} {each.messages:9} {each.pictures:9} {each.rows:9} {each.holes:6} {each.longest_s:16.2f} "
            f"{each.longest_picture_s:14.2f} {each.longest_row_s:10.2f} {until_s - each.picture_s:11.2f} "
            f"{each.connected:10}  {'FROZE' if each.froze else ''}"
        )
    print(f"not measured: {sum(lost)} frames, said in {len(lost)} sentences; exit code {live.returncode}")
    print(f"memory after each tenth, MB: {', '.join(f'{each:.1f}' for each in cost.resident_mb)}")
    print(f"share of a core: {100.0 * cost.core_s / (time.monotonic() - began_s):.1f} %")
    froze = sum(each.froze for each in seen)
    print(f"viewers that froze (more than {FROZEN_S:g} s without a new picture or row): {froze} of {len(seen)}")
    sys.exit(1 if froze else 0)

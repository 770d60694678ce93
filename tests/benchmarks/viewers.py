"""Four pages look at one live view: whether any of them ever stands still.

Run as `python tests/benchmarks/viewers.py [--rate-hz 200] [--seconds 3600] [--viewers 4]` from the top. A simulated
camera runs in a process of its own; each viewer acknowledges what it gets, as the page does. Printed for each viewer:
messages, rows of the history, places where rows are missing, the longest wait for a message, and how often it had to
connect; then what the server said of frames that it could not measure, its resident memory after each tenth of the
time, and its share of a core.
"""

import argparse
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


@dataclass
class Viewer:
    """What one page saw."""

    messages: int = 0
    rows: int = 0
    holes: int = 0
    longest_s: float = 0.0
    connected: int = 0


def look(address: str, until_s: float, seen: Viewer) -> None:
    """Be a page until the time is over."""
    origin = address.partition("/?")[0]
    socket_address = address.replace("http://", "ws://").replace("/?", "/socket?")
    last_frame: int | None = None
    came_s = time.monotonic()
    while time.monotonic() < until_s:
        seen.connected += 1
        try:
            with connect(socket_address, origin=origin, max_size=None) as socket:  # type: ignore[arg-type]
                while time.monotonic() < until_s:
                    content = socket.recv(timeout=30.0)
                    now_s = time.monotonic()
                    seen.longest_s, came_s = max(seen.longest_s, now_s - came_s), now_s
                    (length,) = struct.unpack(">I", content[:4])  # type: ignore[arg-type]
                    points = json.loads(content[4 : 4 + length])["points"]
                    seen.messages += 1
                    for _, _, _, frame, *_ in points:
                        seen.rows += 1
                        seen.holes += last_frame is not None and frame > last_frame + 1
                        last_frame = frame
                    socket.send('{"do":"ack"}')
        except (ConnectionClosed, TimeoutError, OSError):
            time.sleep(0.5)


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


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rate-hz", type=float, default=200.0)
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--viewers", type=int, default=4)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as out:
        command = ["live", "simulated", "--rate-hz", str(chosen.rate_hz), "--port", "0", "--out", str(Path(out) / "o")]
        called = [sys.executable, "-m", "fingervision", *command]
        said = (Path(out) / "said").open("w+")
        live = subprocess.Popen(called, stdout=subprocess.PIPE, stderr=said, text=True)
        assert live.stdout is not None
        found = None
        while found is None:
            found = re.search(r"http://\S+", live.stdout.readline())
        began_s = time.monotonic()
        until_s = began_s + chosen.seconds
        cost = Cost(live.pid)
        seen = [Viewer() for _ in range(chosen.viewers)]
        threads = [Thread(target=look, args=(found[0], until_s, each)) for each in seen]
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
    print(f"{'viewer':>6} {'messages':>9} {'rows':>9} {'holes':>6} {'longest wait, s':>16} {'connected':>10}")
    for number, each in enumerate(seen):
        print(f"{number:6} {each.messages:9} {each.rows:9} {each.holes:6} {each.longest_s:16.2f} {each.connected:10}")
    print(f"not measured: {sum(lost)} frames, said in {len(lost)} sentences; exit code {live.returncode}")
    print(f"memory after each tenth, MB: {', '.join(f'{each:.1f}' for each in cost.resident_mb)}")
    print(f"share of a core: {100.0 * cost.core_s / (time.monotonic() - began_s):.1f} %")


if __name__ == "__main__":
    main()

"""Four pages look at one live view: whether any of them ever stands still.

Run as `python tests/benchmarks/viewers.py [--rate-hz 200] [--seconds 3600] [--viewers 4]` from the top. A simulated
camera runs in a process of its own; each viewer acknowledges what it gets, as the page does. Printed for each viewer:
messages, rows of the history, rows that never came, the longest wait for a message, and how often it had to connect.
"""

import argparse
import json
import re
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
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


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rate-hz", type=float, default=200.0)
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--viewers", type=int, default=4)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as out:
        command = ["live", "simulated", "--rate-hz", str(chosen.rate_hz), "--port", "0", "--out", str(Path(out) / "o")]
        live = subprocess.Popen([sys.executable, "-m", "fingervision", *command], stdout=subprocess.PIPE, text=True)
        assert live.stdout is not None
        found = None
        while found is None:
            found = re.search(r"http://\S+", live.stdout.readline())
        until_s = time.monotonic() + chosen.seconds
        seen = [Viewer() for _ in range(chosen.viewers)]
        threads = [Thread(target=look, args=(found[0], until_s, each)) for each in seen]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        live.terminate()
        live.wait()
    print(f"{'viewer':>6} {'messages':>9} {'rows':>9} {'holes':>6} {'longest wait, s':>16} {'connected':>10}")
    for number, each in enumerate(seen):
        print(f"{number:6} {each.messages:9} {each.rows:9} {each.holes:6} {each.longest_s:16.2f} {each.connected:10}")


if __name__ == "__main__":
    main()

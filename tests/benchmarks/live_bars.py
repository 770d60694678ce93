"""All bars of the live view in one command, on a machine that does nothing else.

    python -m tests.benchmarks.live_bars [--minutes 10]

Five parts run one after the other, each `tests.benchmarks.live` in a process of its own with its camera on loopback,
640x480 at 25 Hz:

* alone, MJPEG over HTTP: processor share of capture and measuring, memory;
* the page open, without and with four viewers and one that sleeps: what these add;
* recording, with walls beside the fingers: frames lost and alarms while the run's camera is learnt;
* MJPEG beside two busy processes, and RTSP (H.264) beside two busy processes: frames lost, lateness.

`--minutes` is the length of each of the parts beside busy processes; the others take a fifth of it. The share of a core
of a part is its own process's: capture, decoding, measuring, serving the page. The camera needs the processor too: what
it did not come to send is told beside what was lost.
"""

import json
import os
import subprocess
import sys
from typing import Any

from tests.benchmarks.frame import Namespace, benchmark, told
from tests.benchmarks.live import FROZEN_S

MOST_ALONE, MOST_ADDED, MOST_GROWN_MB = 0.15, 0.03, 10.0


def part(*options: str) -> dict[str, Any]:
    """Run one part; gives its figures."""
    command = [sys.executable, "-m", "tests.benchmarks.live", "--json", *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)} failed:\n{done.stderr[-2000:]}")
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return figures


@benchmark(minutes=10.0)
def main(chosen: Namespace) -> None:
    """Print the table."""
    long_s = 60.0 * chosen.minutes
    long, short = f"--seconds={long_s}", f"--seconds={max(20.0, long_s / 5.0)}"
    print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
    alone = part(short)
    core = alone["core"]
    told("capture and measuring alone, share of a core", f"{100 * core:.1f} %", "15 %", met=core <= MOST_ALONE)
    page, viewers = part(short, "--page"), part(short, "--page", "--viewers=4")
    added = viewers["core"] - page["core"]
    told("four viewers and a sleeping one add", f"{100 * added:+.1f} % of a core", "3 %", met=added <= MOST_ADDED)
    waited = viewers["waited_s"]
    told("longest wait of a page for a new picture", f"{waited:.2f} s", f"{FROZEN_S:g} s", met=waited <= FROZEN_S)
    print(f"{'with one page open, share of a core':58} {100 * page['core']:>20.1f} %")
    walls = part(short, "--page", "--record", "--wall")
    told("recording with walls: frames lost", f"{walls['lost']} of {walls['measured']}", "none", met=walls["lost"] <= 0)
    told("recording with walls: alarms", " ".join(walls["alarms"]) or "none", "none", met=not walls["alarms"])
    for name, options in (("MJPEG", ()), ("RTSP", ("--rtsp",))):
        busy = part(long, "--busy=2", *options)
        where = f"{name}, {long_s / 60:g} min beside two busy processes"
        told(f"{where}: frames lost", f"{busy['lost']} of {busy['measured']}", "none", met=busy["lost"] <= 0)
        sent = f"{busy['measured']} of {busy['expected']:.0f}"
        print(f"{f'{where}: frames that the camera came to send':58} {sent:>22}")
        late = f"{busy['late_p99_ms']:.1f} ms (worst {busy['late_worst_ms']:.0f})"
        met = busy["late_p99_ms"] <= busy["period_ms"]
        told(f"{where}: late, 99th percentile", late, f"a frame, {busy['period_ms']:.0f} ms", met=met)
        grown = f"{busy['early_mb']:.0f} to {busy['late_mb']:.0f} MB"
        flat = busy["late_mb"] <= busy["early_mb"] + MOST_GROWN_MB
        told(f"{where}: memory", grown, f"flat, within {MOST_GROWN_MB:g} MB", met=flat)
        told(
            f"{where}: share of a core",
            f"{100 * busy['core']:.1f} %",
            "15 % when alone",
            met=busy["core"] <= MOST_ALONE,
        )
    print(f"load of the machine after: {os.getloadavg()[0]:.1f}")

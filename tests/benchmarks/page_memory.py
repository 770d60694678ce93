"""Memory of the page in Chromium (used heap of its scripts, after a collection) and of its server, minute by minute.

Run as `python -m tests.benchmarks.page_memory [--minutes 15]` from the top; the live view is simulated, at 25 Hz.
Printed: resident megabytes of the server, megabytes of the script heap, elements of the document, listeners, and
pictures shown so far. The chart keeps ten minutes of rows, and messages are few, so that after those minutes all of
them must stay as they are.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

from tests.benchmarks.frame import Namespace, benchmark
from tests.live.browser import CHROMIUM, QUIET

START_S, EVERY_S = 120.0, 60.0
MEGABYTE = 1e6
HEADINGS = f"{'min':>5} {'server MB':>9} {'heap MB':>8} {'elements':>9} {'listeners':>10} {'pictures':>9}"


def resident_mb(process: int) -> float:
    """Return the resident memory of a process, in megabytes (Linux: VmRSS, in units of 1024 bytes)."""
    status = Path(f"/proc/{process}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) * 1024 / MEGABYTE


@benchmark(minutes=15.0)
def main(chosen: Namespace) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        log = Path(name) / "log"
        command = [sys.executable, "-m", "fingervision", "live", "simulated", "--port", "0", "--out", f"{name}/out"]
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
        with log.open("w") as out, subprocess.Popen(command, stdout=out, stderr=out, env=environment) as live:
            try:
                until_s = time.monotonic() + START_S
                while not (found := re.search(r"http://\S+token=\S+", log.read_text())):
                    assert time.monotonic() < until_s, log.read_text()
                    time.sleep(0.1)
                browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
                page = browser.new_page()
                page.goto(found[0])
                session = page.context.new_cdp_session(page)
                session.send("Performance.enable")
                print(HEADINGS, flush=True)
                began_s = time.monotonic()
                while (minutes := (time.monotonic() - began_s) / 60.0) <= chosen.minutes:
                    session.send("HeapProfiler.collectGarbage")
                    metrics = {
                        each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]
                    }
                    pictures = page.evaluate("Number(document.querySelector('#picture').dataset.shown || 0)")
                    print(
                        f"{minutes:5.1f} {resident_mb(live.pid):9.1f} {metrics['JSHeapUsedSize'] / MEGABYTE:8.2f} "
                        f"{metrics['Nodes']:9.0f} {metrics['JSEventListeners']:10.0f} {pictures:9}",
                        flush=True,
                    )
                    page.wait_for_timeout(EVERY_S * 1e3)
                browser.close()
            finally:
                live.terminate()

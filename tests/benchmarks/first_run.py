"""The first run after an installation, and the start of every other one.

    python -m tests.benchmarks.first_run [--runs 3]

A copy of the project without any byte code of its own is started in a new folder, with a new cache: first without the
library of its loops (a source tree that is run for the first time: it is compiled), then with it (an installation from
a wheel, which brings it). Columns: seconds from the command to the end, and seconds of processor time, children
included; on a machine that is busy the second is the one to read. `live` is timed to its first measured frame.
"""

import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.benchmarks.frame import Namespace, benchmark

TOP = Path(__file__).resolve().parents[2]
SAMPLE = TOP / "sample_frames" / "opening" / "opening.mp4"
BUDGET_S = {"import": 0.05, "help": 0.15, "measure": 8.0, "live": 3.0}


def copy(folder: Path) -> Path:
    """The project's packages alone, as sources."""
    for part in ("fingervision", "calib"):
        shutil.copytree(TOP / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def timed(command: list[str], folder: Path, until: Callable[[str], bool] | None = None) -> tuple[float, float]:
    """Seconds of the clock and of the processor that a command takes, to its end or to a line of its output."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "XDG_CACHE_HOME": str(folder / "cache")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, *command],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        assert process.stdout is not None
        text = []
        for line in process.stdout:
            text.append(line)
            if until is not None and until(line):
                break
        seconds = time.perf_counter() - start
        if until is not None:
            process.terminate()
            process.stdout.read()
        if process.wait() != 0 and until is None:
            raise RuntimeError("".join(text))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def row(words: str, figures: list[tuple[float, float]], budget_s: float) -> None:
    wall, processor = (statistics.median(column) for column in zip(*figures, strict=True))
    print(f"{words:58}{wall:9.2f}{processor:11.2f}{budget_s:9.2f}", flush=True)


@benchmark(runs=3)
def main(chosen: Namespace) -> None:
    measure = ["-m", "fingervision", "measure", str(SAMPLE), "--px-per-mm", "34", "--out"]
    live = ["-m", "fingervision", "live", "simulated", "--json", "--port", "0", "--out"]
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
        print(f"load of the machine {load:.1f}, {os.cpu_count()} processors\n")
        print(f"{'':58}{'clock s':>9}{'processor':>11}{'budget':>9}")
        new, built = [], []
        for k in range(chosen.runs):
            folder = copy(top / str(k))
            new.append(timed([*measure, str(top / f"new{k}")], folder))
            for cache in folder.rglob("__pycache__"):
                shutil.rmtree(cache)
            built.append(timed([*measure, str(top / f"built{k}")], folder))
        row("first measurement of 300 frames, source tree, compiles", new, BUDGET_S["measure"])
        row("first measurement of 300 frames, installed", built, BUDGET_S["measure"])
        again = [timed([*measure, str(top / f"again{k}")], folder) for k in range(chosen.runs)]
        row("the same again", again, BUDGET_S["measure"])
        first = [
            timed([*live, str(top / f"live{k}")], folder, lambda line: '"gap_px"' in line) for k in range(chosen.runs)
        ]
        row("live: the first measured frame", first, BUDGET_S["live"])
        row(
            "import fingervision",
            [timed(["-c", "import fingervision"], folder) for _ in range(chosen.runs)],
            BUDGET_S["import"],
        )
        row("nothing: Python alone", [timed(["-c", "pass"], folder) for _ in range(chosen.runs)], BUDGET_S["import"])
        row(
            "fingervision --help",
            [timed(["-m", "fingervision", "--help"], folder) for _ in range(chosen.runs)],
            BUDGET_S["help"],
        )

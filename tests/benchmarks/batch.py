"""Rates, memory and costs of a batch; prints tables, asserts nothing.

Run as `python -m tests.benchmarks.batch [--recordings 12] [--frames 1500] [--finished 10000]` on an idle machine
(some minutes). Each line is a figure, with its bar where it has one.

* Workers: the same recordings (H.264, 640x480) with one worker and with two, alternating, three rounds; frames a second
  and the ratio of the medians; whether gaps.csv and gap.png are the same bytes; the rate of `measure` alone beside it.
* Memory: the largest resident set of a worker, and of the process that hands out.
* Finished: a second call over so many finished recordings: seconds and memory.
* Sizing: what a hundred and ten thousand recordings of ten minutes at 25 frames a second cost at the measured rate.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np

from fingervision.batch.result_folder import Record, write_record
from fingervision.batch.run import MARK
from fingervision.batch.task import CURVE_POINTS, Digest
from fingervision.batch.work import content_hash, stamp_of
from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from tests.benchmarks.frame import Namespace, benchmark, told
from tests.clips import h264, write_clip

ROUNDS = 3
LEAST_RATIO, MOST_S, MOST_MB = 1.7, 10.0, 300.0
SCALE = ("--px-per-mm", "34")
FRAMES_OF_TEN_MINUTES = 15000
PROGRAM = r"""
import re, resource, sys
from pathlib import Path
from fingervision.cli import main
sys.argv = ["fingervision", *sys.argv[1:]]
try:
    main()
finally:
    # The largest of this program alone: what getrusage says of it begins with the size of whoever started it.
    own = re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())[1]
    workers = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(f"memory {own} {workers}", file=sys.stderr)
"""


def command(*arguments: object) -> tuple[float, float, float]:
    """Seconds, and MB of the process and of its largest child."""
    started = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *map(str, arguments)],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    seconds = time.perf_counter() - started
    if done.returncode != 0:
        sys.exit(done.stderr)
    _, own, workers = done.stderr.splitlines()[-1].split()
    return seconds, float(own) / 1024.0, float(workers) / 1024.0


def record_clip(path: Path, frames: int) -> None:
    """Fingers that open, with noise; pictures repeat every fifty frames, for drawing takes longer than measuring."""
    rng = np.random.default_rng(1)
    scenes = (two_fingers(gap_px=100.0 + k) for k in range(50))
    pictures = [render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng) for scene in scenes]
    write_clip(path, (Frame(pictures[k % 50], k, 0.04 * k) for k in range(frames)), h264())


def tables_of(out: Path) -> list[str]:
    """Hashes of every table and figure."""
    files = sorted([*out.glob("*/gaps.csv"), *out.glob("*/gap.png")])
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]


def workers(folder: Path, recordings: int, frames: int) -> float:
    """Print the rates of one and two workers; frames a second of one."""
    first = folder / "recordings" / "r000.mp4"
    first.parent.mkdir()
    record_clip(first, frames)
    for k in range(1, recordings):
        shutil.copy(first, first.with_name(f"r{k:03d}.mp4"))
    seconds: dict[int, list[float]] = {1: [], 2: []}
    memory: dict[int, float] = {}
    alone_s = []
    for k in range(ROUNDS):
        for jobs in (1, 2):
            out = folder / f"jobs{jobs}_{k}"
            taken, _, worker = command(
                "batch", "measure", f"{first.parent}/*.mp4", *SCALE, "--jobs", jobs, "--out", out
            )
            seconds[jobs].append(taken)
            memory[jobs] = worker
        taken, _, _ = command("measure", first, *SCALE, "--out", folder / "alone")
        alone_s.append(taken)
    same = all(tables_of(folder / f"jobs1_{k}") == tables_of(folder / f"jobs2_{k}") for k in range(ROUNDS))
    total = recordings * frames
    ratio = median(seconds[1]) / median(seconds[2])
    size_mb = first.stat().st_size / 1e6
    print(
        f"{recordings} recordings of {frames} frames, 640x480, H.264, {size_mb:.1f} MB each; median of {ROUNDS} rounds"
    )
    for jobs, found in seconds.items():
        told(f"workers: {jobs}", f"{median(found):.1f} s, {total / median(found):.0f} frames/s")
    told("two workers over one", f"{ratio:.2f}", f"at least {LEAST_RATIO}", ratio >= LEAST_RATIO)
    told("tables and figures of both the same bytes", "yes" if same else "no", "yes", same)
    told("`measure` alone, start-up included", f"{frames / median(alone_s):.0f} frames/s")
    told("memory of a worker", f"{max(memory.values()):.0f} MB")
    told("load of the machine at the end (2 is this benchmark's own)", f"{os.getloadavg()[0]:.1f}")
    return total / median(seconds[1])


def finished(folder: Path, count: int) -> None:
    """Print what a second call over finished recordings costs."""
    recordings, out = folder / "many", folder / "many_out"
    recordings.mkdir()
    out.mkdir()
    (out / MARK).write_text('{"schema": 1, "command": "measure"}\n', encoding="utf-8")
    rng = np.random.default_rng(2)
    from click import Option

    from fingervision.cli.batch import _options_key
    from fingervision.cli.measure import command as measure

    option = next(one for one in measure.params if isinstance(one, Option) and one.name == "px_per_mm")
    key = _options_key("measure", {option: 34.0})
    for k in range(count):
        path = recordings / f"r{k:05d}.mp4"
        path.write_bytes(rng.bytes(1000))
        os.utime(path, (1.0e9, 1.0e9))
        result = out / path.name
        result.mkdir()
        curve = tuple(float(f"{value:.5g}") for value in rng.normal(4.0, 1.0, CURVE_POINTS))
        cells = dict.fromkeys(("least_mm", "median_mm", "mean_mm", "greatest_mm", "median_u_random_mm"), 4.0)
        digest = Digest({"frames": 15000, "ok_frames": 15000, **cells}, curve, "3 to 5 mm")
        write_record(result, result, Record(str(path), stamp_of(path), content_hash(path), key, 0, "", 20.0, digest))
    arguments = ("batch", "measure", f"{recordings}/*.mp4", *SCALE, "--out", out)
    first_s, first_mb, _ = command(*arguments)
    second_s, second_mb, _ = command(*arguments)
    told(
        f"second call over {count} finished recordings", f"{second_s:.1f} s", f"within {MOST_S:g} s", second_s <= MOST_S
    )
    told("its memory", f"{second_mb:.0f} MB", f"within {MOST_MB:g} MB", second_mb <= MOST_MB)
    told("the same with the overview written anew", f"{first_s:.1f} s, {first_mb:.0f} MB")
    told("index.html", f"{(out / 'index.html').stat().st_size / 1e6:.1f} MB")


@benchmark(recordings=12, frames=1500, finished=10000)
def main(chosen: Namespace) -> None:
    """Read the options and print."""
    with TemporaryDirectory() as name:
        rate_hz = workers(Path(name), chosen.recordings, chosen.frames)
        finished(Path(name), chosen.finished)
    hours = FRAMES_OF_TEN_MINUTES / rate_hz / 3600.0
    for count in (100, 10000):
        told(f"{count} recordings of ten minutes at 25 frames/s, calculated", f"{count * hours:.1f} core hours")

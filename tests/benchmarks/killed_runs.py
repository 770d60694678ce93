"""`kill -9` at random moments of a run on the bed: what is lost, whether the folder is valid, how it is gone on with.

Run as `python -m tests.benchmarks.killed_runs [--moments 50] [--seed 1] [--out DIR]` from the top. A run in real time
is killed at a random moment between its first and its last frame; then the same command is given again, as fast as it
goes. Printed: how many folders were valid (table and video can be read and belong together, run.json says that it is
not complete), the most seconds lost (frames that had come and have no row), and how many resumed runs ended with the
very table of a run that was never killed.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from fingervision.storage.recipe_toml import write_recipe
from fingervision.storage.recorded_video import frames_in
from fingervision.storage.samples_csv import read_samples
from tests.benchmarks.frame import Namespace, benchmark

STEPS: tuple[dict[str, object], ...] = (
    {"kind": "triangle", "from_mm": -0.2, "to_mm": 0.4, "speed_mm_s": 0.4},
    {"kind": "staircase", "from_mm": -0.2, "to_mm": 0.4, "steps": 2, "dwell_s": 0.1, "speed_mm_s": 1.0, "frames": 3},
    {"kind": "rezero"},
    {"kind": "move", "to_mm": 0.3, "speed_mm_s": 0.5},
)
RATE_HZ = 25.0
HELD_BACK = 1
"""A fragment of the video is written when the next picture comes: before a pause the table may be a row ahead."""


def command(recipe: Path, out: Path, *more: str) -> list[str]:
    """The command of a run."""
    return [sys.executable, "-m", "fingervision", "bed", "run", str(recipe), "--out", str(out), *more]


@benchmark(moments=50, seed=1, out=Path("build/killed_runs"))
def main(chosen: Namespace) -> None:
    """Print the table."""
    shutil.rmtree(chosen.out, ignore_errors=True)
    chosen.out.mkdir(parents=True)
    recipe = chosen.out / "recipe.toml"
    write_recipe(recipe, "to be killed", STEPS)
    subprocess.run(command(recipe, chosen.out / "whole"), check=True, stdout=subprocess.DEVNULL)
    whole = (chosen.out / "whole" / "samples.csv").read_bytes()
    seconds = read_samples(chosen.out / "whole" / "samples.csv")[-1].time_s
    rng = np.random.default_rng(chosen.seed)
    valid, same, lost_s = 0, 0, []
    for k in range(chosen.moments):
        out = chosen.out / f"{k}"
        process = subprocess.Popen(command(recipe, out, "--real-time"), stdout=subprocess.DEVNULL)
        while frames_in(out / "video.mp4") == 0 and process.poll() is None:
            time.sleep(0.02)
        time.sleep(rng.uniform(0.0, seconds))
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        rows, frames = read_samples(out / "samples.csv"), frames_in(out / "video.mp4")
        about = json.loads((out / "run.json").read_text())
        valid += frames >= len(rows) - HELD_BACK and (about["complete"] is False or len(rows) == frames)
        lost_s.append((frames - len(rows)) / RATE_HZ)
        if about["complete"]:
            same += (out / "samples.csv").read_bytes() == whole
            continue
        done = subprocess.run(command(recipe, out), check=False, stdout=subprocess.DEVNULL)
        same += done.returncode == 0 and (out / "samples.csv").read_bytes() == whole
        shutil.rmtree(out)
    print(f"killed at {chosen.moments} moments of {seconds:.1f} s")
    print(f"{valid} folders valid, at most {max(lost_s):.2f} s lost")
    print(f"{same} of {chosen.moments} resumed runs ended with the table of a run that was never killed")

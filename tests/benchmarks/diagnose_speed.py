"""Print the duration of a diagnosis for tables of different length; nothing is asserted.

    python -m tests.benchmarks.diagnose_speed [--samples 100,2000,20000] [--hidden backlash,nothing,two]

A stage is simulated in six runs with loops, holds and reversals at two speeds. Its input is read with jitter, and it
has play, no effect, or play and an offset. Wall time depends on other programs on the computer (the load is printed);
processor time is that of the diagnosis alone, summed over all cores.
"""

import os
import tempfile
import time
from pathlib import Path

import numpy as np

from fingervision.diagnosis.diagnose import diagnose
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.benchmarks.frame import Namespace, benchmark

BARS_S = {100: 2.0, 2000: 5.0, 20000: 30.0}
RATE_HZ = 20.0
EDGE_MM, INPUT_MM = 0.005, 0.0004
RUNS = 6
PLAY_MM, OFFSET_MM = 0.02, 0.03
HIDDEN = ("backlash", "nothing", "two")


def stage(samples: int, run: int) -> np.ndarray:
    """Input of one run, shape (samples,), in mm: loops of decreasing size, then a hold; every second run is slower."""
    time_s = np.arange(samples) / RATE_HZ
    period = 20.0 if run % 2 else 8.0
    loop = 0.9 * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * time_s / period))
    return np.where(time_s < 0.8 * time_s[-1], loop * np.linspace(1.0, 0.5, samples), 0.2)


def played(u: np.ndarray, play_mm: float) -> np.ndarray:
    """Output of a play operator, computed sample by sample."""
    out = np.empty_like(u)
    at = u[0]
    for i, x in enumerate(u):
        at = min(max(at, x - 0.5 * play_mm), x + 0.5 * play_mm)
        out[i] = at
    return out


def write(folder: Path, samples: int, hidden: str, seed: int) -> None:
    """Write measured.csv and sim.csv to a folder."""
    rng = np.random.default_rng(seed)
    grid = np.linspace(-1.2, 1.2, 25)
    gap = 8.0 + 6.0 * grid + 0.3 * grid**2
    rows, clock = ["run,time_s,input_mm,gap_mm,left_mm,right_mm"], 0.0
    for run in range(RUNS):
        u = stage(samples // RUNS, run)
        driven = u if hidden == "nothing" else played(u, PLAY_MM)
        true = np.interp(driven, grid, gap) + (OFFSET_MM if hidden == "two" else 0.0)
        left, right = (0.1 + side * true / 2 + EDGE_MM * rng.standard_normal(u.size) for side in (-1, 1))
        read = u + INPUT_MM * rng.standard_normal(u.size)
        rows += [
            f"{run},{clock + k / RATE_HZ},{read[k]},{right[k] - left[k]},{left[k]},{right[k]}" for k in range(u.size)
        ]
        clock += u.size / RATE_HZ + 10.0
    (folder / "measured.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    lines = [f"{u},{g}" for u, g in zip(grid, gap, strict=True)]
    (folder / "sim.csv").write_text("input_mm,gap_mm\n" + "\n".join(lines) + "\n", encoding="utf-8")


@benchmark(samples="100,2000,20000", hidden={"default": ",".join(HIDDEN)})
def main(chosen: Namespace) -> None:
    """Read the options, measure the durations, and print the table."""
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; the first line compiles where nothing is cached")
    print("samples  hidden    wall s  processor s  bar s  verdict")
    for samples in map(int, chosen.samples.split(",")):
        for hidden in chosen.hidden.split(","):
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                write(folder, samples, hidden, 1)
                table, model = read_measured_table(folder / "measured.csv"), read_model(folder / "sim.csv")
                wall, processor = time.perf_counter(), time.process_time()
                report = diagnose(table, model).report
                wall, processor = time.perf_counter() - wall, time.process_time() - processor
            found = " or ".join("+".join(names) for names in report.alternatives) or "-"
            bar = BARS_S.get(samples)
            shown = "-" if bar is None else f"{bar:.0f}"
            print(
                f"{samples:7d}  {hidden:8s}  {wall:6.1f}  {processor:11.1f}  {shown:>5s}  {report.verdict}: {found}",
                flush=True,
            )
    print(f"load {os.getloadavg()[0]:.1f} at the end")

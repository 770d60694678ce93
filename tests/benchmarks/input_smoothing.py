"""Error of the recorded input after smoothing, true and as stated, both as shares of the variance before smoothing.

    python -m tests.benchmarks.input_smoothing --records 200 --seed 2

Motions, noise and encoders are those of the benchmark `hidden`.
"""

from collections import defaultdict
from itertools import pairwise

import numpy as np

from fingervision.motion.encoder import input_sigma
from fingervision.motion.local_polynomial_smoothing import blended, smoothed
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.hidden.design import Kind, draw_design
from tests.benchmarks.hidden.gripper_table import draw_table
from tests.benchmarks.hidden.noise import draw_noise, rounded

KINDS: tuple[Kind, ...] = ("rich", "ordinary", "poor")
SINE = 2
"""Number of the first sinusoidal run in a rich design; every fourth run after it is sinusoidal too."""


@benchmark(records=200, seed=2)
def main(asked: Namespace) -> None:
    """Simulate records, smooth the records, and print the table."""
    rng = np.random.default_rng(asked.seed)
    left: dict[tuple[str, str, str], list[tuple[float, float]]] = defaultdict(list)
    drawn = 0
    while drawn < asked.records:
        kind = KINDS[drawn % len(KINDS)]
        table, inputs = draw_table(rng, with_force=False)
        design = draw_design(rng, kind, inputs)
        slope = float(np.mean(np.abs(table.slope(np.linspace(inputs.lower_mm, inputs.upper_mm, 21)))))
        noise = draw_noise(rng, len(design.motions), slope, inputs.width_mm)
        if noise.input_variance_mm2 == 0.0:
            continue
        drawn += 1
        times = [np.arange(0.0, motion.duration_s, 1.0 / design.rate_hz) for motion in design.motions]
        ends = np.cumsum([0, *(time.size for time in times)])
        runs = tuple(slice(a, b) for a, b in pairwise(ends))
        true = np.concatenate([motion.at(time) for motion, time in zip(design.motions, times, strict=True)])
        recorded = rounded(true + noise.input_mm * rng.standard_normal(true.size), noise.encoder_step_mm)
        sigma, step = input_sigma(recorded, runs)
        if sigma == 0.0:
            continue
        found, leverage = smoothed(recorded, np.concatenate(times), runs, sigma, step)
        found = blended(found, recorded, np.concatenate(times), runs, leverage)
        error = (found - true) ** 2 / noise.input_variance_mm2
        claim = leverage * sigma**2 / noise.input_variance_mm2
        for index, run in enumerate(runs):
            motion = "sine" if kind == "rich" and index % 4 == SINE else "lines"
            row = (kind, motion, "encoder" if noise.encoder_step_mm else "noise")
            left[row] += zip(error[run].tolist(), claim[run].tolist(), strict=True)
    print("design    motion  error     left  claimed  samples")
    for row, values in sorted(left.items()):
        mean = np.mean(values, axis=0)
        print(f"{row[0]:<9} {row[1]:<7} {row[2]:<8} {mean[0]:5.2f} {mean[1]:8.2f} {len(values):8d}")

"""Continuous strokes of a stage with a smooth map of position errors, mostly with play; several cycles in both
directions.
"""

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.error_map import draw_map
from tests.benchmarks.world.moving import joined, line_over, moving_rig, read, smooth_strokes
from tests.benchmarks.world.rig import Hidden, Rig
from tests.benchmarks.world.rows.free_start import draw_start


def draw(rng: np.random.Generator) -> Rig:
    """Map and play, a map alone, or no effect (a tenth of the tables)."""
    width = log_uniform(rng, 2.0, 100.0)
    cycles = int(rng.integers(2, 5))
    rate = float(rng.choice([10.0, 20.0, 50.0]))
    stroke_s = 1400 / (2 * cycles * rate) * float(rng.uniform(0.3, 0.8))
    low = float(rng.choice([0.0, -width / 2]))
    corners = low + width * np.array([0.0, 1.0] * cycles + [0.0])
    motion = joined([smooth_strokes(corners, 1.2 * width / stroke_s, rate)])
    noise = log_uniform(rng, 0.0003, 0.003)
    nothing = rng.random() < 0.1
    rms = log_uniform(rng, 0.002, 0.04)
    play = 0.0 if nothing or rng.random() < 0.3 else log_uniform(rng, 0.003, 0.06)
    bent = draw_map(rng, np.linspace(low, low + width, 400), rms, int(rng.integers(2, 7)))
    u = motion.input_mm + (0.0 if nothing else bent(motion.input_mm))
    place = physics.play(u, play, draw_start(rng))
    hidden = () if nothing else (Hidden("position_error_map", {"rms_mm": rms}),)
    if play:
        hidden += (Hidden("backlash", {"play_mm": play}),)
    zero = float(np.ceil(2 - low))
    gap, sd = read(rng, zero + place, noise, 1e-6)
    return moving_rig(
        motion, motion.input_mm, zero + place, gap, line_over(motion.input_mm, zero), hidden, noise_mm=sd,
        kind="null" if nothing else "map and play" if play else "map",
    )  # fmt: skip

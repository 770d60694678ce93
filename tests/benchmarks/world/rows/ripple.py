"""Motion in one direction at constant speed, measured by a resolver with a cyclic error."""

import numpy as np

from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.moving import Motion, line_over, moving_rig, read
from tests.benchmarks.world.rig import Hidden, Rig


def draw(rng: np.random.Generator) -> Rig:
    """A cyclic error, in a third of the tables with a weak second harmonic, or no effect (a seventh of the tables)."""
    period = log_uniform(rng, 0.05, 2.0)
    per_period = float(rng.uniform(12, 50))
    count = int(rng.integers(300, 1400))
    u = float(rng.uniform(0, 2)) + period / per_period * np.arange(count)
    rate = float(rng.choice([10.0, 33.0, 50.0]))
    noise = log_uniform(rng, 0.0001, 0.002)
    nothing = rng.random() < 0.14
    amplitude = 0.0 if nothing else noise * log_uniform(rng, 3.0, 60.0)
    phase = float(rng.uniform(0, 2 * np.pi))
    angle = 2 * np.pi * u / period + phase
    second = 0.08 if rng.random() < 0.33 else 0.0
    place = u + amplitude * (np.sin(angle) + second * np.sin(2 * angle + 1.0))
    hidden = (
        ()
        if nothing
        else (Hidden("encoder_cyclic_error", {"amplitude_mm": amplitude, "period_mm": period, "phase_rad": phase}),)
    )
    gap, sd = read(rng, 3.0 + place, noise, 1e-6)
    motion = Motion(np.arange(count) / rate, u, np.zeros(count, dtype=np.int64))
    return moving_rig(
        motion, u, 3.0 + place, gap, line_over(u, 3.0), hidden, noise_mm=sd,
        kind="null" if nothing else "with a harmonic" if second else "pure",
    )  # fmt: skip

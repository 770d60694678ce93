"""A servo or stage that is driven into its end stop while the command continues; readings in whole counts."""

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.moving import Motion, line_over, moving_rig
from tests.benchmarks.world.rig import Hidden, Rig


def draw(rng: np.random.Generator) -> Rig:
    """Motion in one or both directions, with a stop at one end, or without a stop (a seventh of the tables)."""
    width = log_uniform(rng, 0.5, 5.0)
    count = int(rng.integers(60, 200))
    low = float(rng.choice([0.0, -width, -0.5 * width]))
    u = low + width * np.linspace(0, 1, count)
    if rng.random() < 0.5:
        u = u[::-1]
    if rng.random() < 0.3:
        u = np.concatenate([u, u[::-1]])
    time = float(rng.choice([0.1, 0.2, 0.5])) * np.arange(u.size)
    counts = width / count * log_uniform(rng, 0.05, 0.8)
    noise = counts * float(rng.uniform(0.3, 1.5))
    nothing = rng.random() < 0.14
    upper = bool(rng.random() < 0.5)
    depth = width * float(rng.uniform(0.05, 0.25))
    place, hidden = u, ()
    if not nothing and upper:
        place, hidden = np.minimum(u, u.max() - depth), (Hidden("end_stop", {"upper_mm": float(u.max() - depth)}),)
    elif not nothing:
        place, hidden = np.maximum(u, u.min() + depth), (Hidden("end_stop", {"lower_mm": float(u.min() + depth)}),)
    stands = place != u
    zero = float(np.ceil(1.5 - low))
    clean = zero + place
    noisy = clean + noise * rng.standard_normal(u.size)
    # A stage that presses against its stop has no jitter.
    gap = physics.rounded(np.where(stands, clean, noisy), counts)
    motion = Motion(time, u, np.zeros(u.size, dtype=np.int64))
    return moving_rig(
        motion, u, clean, gap, line_over(u, zero), hidden,
        noise_mm=float(np.hypot(noise, counts / np.sqrt(12))),
        kind="null" if nothing else "upper" if upper else "lower",
    )  # fmt: skip

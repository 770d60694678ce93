"""A polymer finger (generalised Maxwell solid) with holds after steps; the gain differs slightly between runs."""

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.moving import joined, line_over, moving_rig, read, smooth_strokes
from tests.benchmarks.world.rig import Array, Hidden, Rig

TAUS_S = np.array([1.0, 4.0, 16.0, 64.0])


def _held(rng: np.random.Generator, width: float, rate: float) -> tuple[Array, Array]:
    times, places, now, here = [], [], 0.0, 0.0
    for _ in range(int(rng.integers(2, 5))):
        goal = float(rng.uniform(0.3, 1.0)) * width if here < 0.3 * width else 0.0
        t, u = smooth_strokes(np.array([here, goal]), width / rng.uniform(0.3, 1.0), rate, float(rng.uniform(8, 40)))
        times.append(now + t[1:])
        places.append(u[1:])
        now, here = now + float(t[-1]), goal
    return np.concatenate([[0.0], *times]), np.concatenate([[0.0], *places])


def draw(rng: np.random.Generator) -> Rig:
    """Creep with the catalogue's four time constants or with three others, or no creep (a seventh of the tables)."""
    width, rate = log_uniform(rng, 0.5, 5.0), float(rng.choice([5.0, 10.0]))
    motion = joined([_held(rng, width, rate) for _ in range(int(rng.integers(2, 5)))])
    nothing = rng.random() < 0.14
    same_times = bool(rng.random() < 0.5)
    taus = TAUS_S if same_times else np.sort(np.exp(rng.uniform(np.log(0.8), np.log(60.0), 3)))
    shares = rng.dirichlet(np.ones(taus.size)) * rng.uniform(0.05, 0.35)
    gain = 0.0 if rng.random() < 0.4 else log_uniform(rng, 0.001, 0.01)
    slope = log_uniform(rng, 1.0, 6.0)
    noise = log_uniform(rng, 0.001, 0.01)
    opening = slope * motion.input_mm
    for rows in motion.parts():
        own = 1 + gain * rng.standard_normal()
        if not nothing:
            opening[rows] = physics.maxwell(motion.time_s[rows], opening[rows], shares, taus)
        opening[rows] *= own
    clean = 2.0 + opening
    gap, sd = read(rng, clean, noise, 0.0)
    sizes = {f"fraction_{k}s": float(s) for k, s in zip((1, 4, 16, 64), shares, strict=True)} if same_times else {
        f"fraction_{k}s": float(shares.sum()) / 4 for k in (1, 4, 16, 64)}  # fmt: skip
    hidden = () if nothing else (Hidden("viscoelastic_creep", sizes),)
    return moving_rig(
        motion, motion.input_mm, clean, gap, line_over(motion.input_mm, 2.0, slope), hidden, noise_mm=sd,
        kind=f"{'null' if nothing else 'creep'}{', gains differ' if gain else ''}", run_gain=gain,
        exact_forms=same_times,
    )  # fmt: skip

"""Strokes at constant speed that turn between two rows of a camera, with rows missing: the most usual first record."""

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.moving import Motion, line_over, moving_rig, read
from tests.benchmarks.world.rig import Hidden, Path, Rig

RATE_HZ = 25.0
MISSING = (0.0, 0.0, 0.1, 0.3)
"""Shares of rows that are missing: frames that were dropped or refused."""


def draw(rng: np.random.Generator) -> Rig:
    """Play about as large as the motion between two rows, a delay, an offset, or no effect."""
    stroke, speed = float(rng.uniform(0.5, 2.0)), float(rng.uniform(0.2, 1.0))
    corners_s = stroke / speed * np.arange(int(rng.integers(5, 12)))
    rows_s = np.arange(rng.uniform(0.0, 1.0 / RATE_HZ), corners_s[-1], 1.0 / RATE_HZ)
    rows_s = rows_s[rng.random(rows_s.size) >= rng.choice(MISSING)]
    kind = str(rng.choice(["play", "play", "delay", "offset", "null"]))
    play, delay = float(rng.uniform(0.3, 3.0)) * speed / RATE_HZ, float(rng.uniform(0.03, 0.2))
    offset, start = float(rng.choice([-1, 1]) * rng.uniform(0.005, 0.03)), float(rng.uniform(-1, 1))
    # The stage's motion is linear between these points, which include its corners.
    every_s = np.union1d(rows_s, corners_s)
    row = np.searchsorted(every_s, rows_s)
    path_mm = np.interp(every_s, corners_s, stroke * (np.arange(corners_s.size) % 2))
    place = path_mm[row]
    hidden: tuple[Hidden, ...] = ()
    if kind == "play":
        hidden, place = (Hidden("backlash", {"play_mm": play}),), physics.play(path_mm, play, start)[row]
    elif kind == "delay":
        hidden = (Hidden("drive_lag", {"delay_s": delay}),)
        place = np.interp(rows_s - delay, every_s, path_mm)
    elif kind == "offset":
        hidden, place = (Hidden("input_offset", {"offset_mm": offset}),), place + offset
    slope = float(rng.uniform(0.8, 3.0))
    simulation = line_over(path_mm, 3.0 + slope * stroke, slope)
    clean = simulation.gap(place)
    noise = log_uniform(rng, 0.0005, 0.003)
    gap, sd = read(rng, clean, noise, 1e-6)
    motion = Motion(rows_s, path_mm[row], np.ones(rows_s.size, dtype=np.int64))
    path = Path(every_s, path_mm, row, np.array([0, every_s.size]), at_rest=False, commanded=True)
    return moving_rig(
        motion,
        motion.input_mm,
        clean,
        gap,
        simulation,
        hidden,
        noise_mm=sd,
        kind=f"{kind}, {rows_s.size} rows",
        path=path,
    )

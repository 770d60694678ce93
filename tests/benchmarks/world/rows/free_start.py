"""Dense records of a stage or rotary table whose play or friction has any start state, mostly at an end."""

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.moving import joined, line_over, moving_rig, read, smooth_strokes
from tests.benchmarks.world.rig import Hidden, Rig

RATES_HZ = (10.0, 25.0, 50.0)


def draw_start(rng: np.random.Generator) -> float:
    """Start state, at one of the ends in two of three records."""
    return float(rng.choice([-1.0, 1.0])) if rng.random() < 0.67 else float(rng.uniform(-1, 1))


def draw(rng: np.random.Generator) -> Rig:
    """Play, a friction loop, or no effect; in a third of the tables, the reference is set to zero at the first row."""
    width = log_uniform(rng, 0.2, 20.0)
    rate = float(rng.choice(RATES_HZ))
    way = float(rng.choice([-1, 1]))
    runs = []
    for _ in range(int(rng.integers(1, 4))):
        turns = int(rng.integers(1, 5))
        ends = np.concatenate(
            [[0.0], *[[w, v] for w, v in zip(rng.uniform(0.5, 1, 4), rng.uniform(0, 0.3, 4), strict=True)]]
        )
        corners = way * width * ends[: turns + 2]
        runs.append(smooth_strokes(corners, width / rng.uniform(3, 12), rate, float(rng.choice([0.0, 0.5]))))
    motion = joined(runs)
    noise = log_uniform(rng, 0.0003, 0.003)
    kind = str(rng.choice(["play", "play", "play", "friction", "null"]))
    # Not more than two fifths of the travel, so that the play is taken up within the travel.
    play = min(log_uniform(rng, 0.005, 0.1), 0.4 * width)
    fraction, reach = float(rng.uniform(0.05, 0.4)), width * float(rng.uniform(0.05, 0.4))
    place = motion.input_mm.copy()
    for rows in motion.parts():
        start, u = draw_start(rng), motion.input_mm[rows]
        if kind == "play":
            place[rows] = physics.play(u, play, start)
        elif kind == "friction":
            place[rows] = physics.friction_loop(u, fraction, reach, start)
    hidden = {
        "play": (Hidden("backlash", {"play_mm": play}),),
        "friction": (Hidden("friction_hysteresis", {"fraction": fraction, "reach_mm": reach}),),
        "null": (),
    }[kind]
    zeroed = kind != "null" and rng.random() < 0.33
    shift = float(motion.input_mm[0] - place[0]) if zeroed else 0.0
    if zeroed and shift:
        hidden += (Hidden("rest_gap_error", {"offset_mm": shift}),)
    simulation = line_over(motion.input_mm, 3.0 + width)
    clean = 3.0 + width + place + shift
    gap, sd = read(rng, clean, noise, 1e-6)
    return moving_rig(
        motion, motion.input_mm, clean, gap, simulation, hidden, noise_mm=sd,
        kind=f"{kind}{', zeroed' if zeroed else ''}",
    )  # fmt: skip

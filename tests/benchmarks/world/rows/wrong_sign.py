"""Tables with a wrong sign: directions exchanged, the input mirrored, or the gap mirrored."""

from dataclasses import replace

import numpy as np

from tests.benchmarks.world.at_rest import Parts, Reading, log_uniform, read_at_rest
from tests.benchmarks.world.moving import joined, line_over, moving_rig, read, smooth_strokes
from tests.benchmarks.world.rig import Path, Rig, Simulation
from tests.benchmarks.world.rows.iso_cycles import draw_stations


def draw(rng: np.random.Generator) -> Rig:
    """Draw one of the three kinds of table."""
    return (_directions, _input, _gap)[int(rng.integers(3))](rng)


def _directions(rng: np.random.Generator) -> Rig:
    """Approaches from above are called forward, so that a play has the wrong sign."""
    stations, targets = draw_stations(rng, listed=bool(rng.random() < 0.6))
    noise = log_uniform(rng, 0.0002, 0.002)
    play = noise * log_uniform(rng, 10.0, 40.0)
    up = np.diff(stations.position_mm, prepend=stations.position_mm[0] - 1) > 0
    place = stations.position_mm + np.where(up, 1, -1) * play / 2
    simulation = str(rng.choice(["line", "map"]))
    reading = Reading(noise, 1e-6, float(np.ceil(2 - targets[0] + 0.1)), simulation, kind="directions")
    rig = read_at_rest(rng, stations, Parts(), reading, place)
    return replace(rig, wrong_sign="directions", outside="a play against the direction of motion")


def _input(rng: np.random.Generator) -> Rig:
    """The input has the wrong sign; the stage is without an error."""
    width, rate = log_uniform(rng, 1.0, 10.0), 20.0
    corners = width * np.array([0.0, 0.6, -0.4, 0.5, 0.0])
    motion = joined([smooth_strokes(corners, width / rng.uniform(4, 8), rate)])
    noise = width * log_uniform(rng, 1e-4, 2e-3)
    slope = log_uniform(rng, 1.0, 5.0)
    zero = 2.0 + slope * width
    clean = zero + slope * motion.input_mm
    gap, sd = read(rng, clean, noise, 0.0)
    span = np.array([-0.8 * width, 0.8 * width])
    turned = replace(motion, input_mm=-motion.input_mm)
    return moving_rig(
        turned, turned.input_mm, clean, gap, Simulation(span, zero + slope * span), (), noise_mm=sd, kind="input",
        wrong_sign="input", outside="the input has the wrong sign",
    )  # fmt: skip


def _gap(rng: np.random.Generator) -> Rig:
    """The gap decreases instead of increasing, as for an encoder with reversed direction and its zero in the middle."""
    width, rate = log_uniform(rng, 1.0, 10.0), 20.0
    corners = width * np.array([0.0, 1.0, 0.0, 0.6, 0.1])
    motion = joined([smooth_strokes(corners, width / rng.uniform(4, 8), rate)])
    noise = width * log_uniform(rng, 1e-4, 2e-3)
    zero = 2.0
    clean = zero + width - motion.input_mm
    gap, sd = read(rng, clean, noise, 0.0)
    path = Path.of_rows(motion.time_s, motion.input_mm, motion.run, at_rest=False)
    return moving_rig(
        motion, motion.input_mm, clean, gap, line_over(motion.input_mm, zero), (), noise_mm=sd, kind="gap",
        path=path, wrong_sign="gap", outside="the gap has the wrong sign",
    )  # fmt: skip

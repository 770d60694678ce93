"""Inputs recorded by an encoder of 10 to 50 um whose zero lies anywhere within a step, with jitter."""

from dataclasses import replace

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.moving import joined, moving_rig, read, smooth_strokes
from tests.benchmarks.world.rig import Hidden, Rig, Simulation
from tests.benchmarks.world.rows.free_start import draw_start


def drawn_with(
    rng: np.random.Generator, step_mm: float, jitter_mm: float, play_mm: float, *, kind: str, true_zero: bool
) -> Rig:
    """A lever driven by a stage with play; with `true_zero` the mean of the record is right, otherwise it has an
    offset.
    """
    slope = log_uniform(rng, 1.0, 8.0)
    width = float(rng.uniform(1.0, 3.0))
    rate = float(rng.uniform(5, 20))
    runs = []
    for k in range(int(rng.integers(2, 6))):
        ends = width * np.array([0.0, 1.0, 0.0, rng.uniform(0.5, 1.0), rng.uniform(0.0, 0.4)])
        runs.append(smooth_strokes(ends, width / rng.uniform(3, 9), rate, float(k % 2)))
    motion = joined(runs)
    noise = log_uniform(rng, 0.002, 0.01)
    place = motion.input_mm.copy()
    for rows in motion.parts():
        place[rows] = physics.play(motion.input_mm[rows], play_mm, draw_start(rng))
    zero = float(rng.uniform(-0.5, 0.5)) * step_mm
    recorded = physics.rounded(motion.input_mm - zero, step_mm) + (zero if true_zero else 0.0)
    recorded = recorded + jitter_mm * rng.standard_normal(recorded.size)
    rest = float(rng.uniform(0.5, 2.0))
    bend = float(rng.uniform(-0.03, 0.03))
    table = np.linspace(-0.2 * width, 1.2 * width, 15)
    simulation = Simulation(table, rest + slope * (table + bend * table**2 / width))
    clean = simulation.gap(place)
    gap, sd = read(rng, clean, noise, 0.0)
    hidden: tuple[Hidden, ...] = () if true_zero else (Hidden("input_offset", {"offset_mm": zero}),)
    if play_mm:
        hidden += (Hidden("backlash", {"play_mm": play_mm}),)
    # The record without rounding and jitter: its zero differs by an offset of the input.
    said = motion if true_zero else replace(motion, input_mm=motion.input_mm - zero)
    return moving_rig(
        said, recorded, clean, gap, simulation, hidden,
        noise_mm=sd, kind=kind, input_error_mm=float(np.hypot(jitter_mm, step_mm / np.sqrt(12))),
    )  # fmt: skip


def draw(rng: np.random.Generator) -> Rig:
    """Steps of 10 to 50 um, jitter of 1 to 5 um, a play of 20 to 150 um; a tenth of the tables have no effect."""
    step, jitter = float(rng.uniform(0.01, 0.05)), float(rng.uniform(0.001, 0.005))
    nothing = rng.random() < 0.1
    true_zero = nothing or bool(rng.random() < 0.6)
    play = 0.0 if nothing else log_uniform(rng, max(0.02, step), 0.15)
    kind = "null" if nothing else "true zero" if true_zero else "zero off"
    return drawn_with(rng, step, jitter, play, kind=kind, true_zero=true_zero)


def draw_bar(rng: np.random.Generator) -> Rig:
    """Fixed case with required results: a step of 30 um, a jitter of 3 um, a play of 50 um."""
    true_zero = bool(rng.random() < 0.5)
    return drawn_with(rng, 0.03, 0.003, 0.05, kind="true zero" if true_zero else "zero off", true_zero=true_zero)


def draw_kind(rng: np.random.Generator, jitter_mm: float, *, true_zero: bool) -> Rig:
    """One of six kinds of encoder, with a step of 30 um and a play of 50 um: zero on or off a step, various jitter."""
    return drawn_with(rng, 0.03, jitter_mm, 0.05, kind="true zero" if true_zero else "zero off", true_zero=true_zero)

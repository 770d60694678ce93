"""Effects outside the catalogue: play that depends on position, run-in, steps of a dead band, dry damping."""

from dataclasses import replace

import numpy as np

from tests.benchmarks.world.at_rest import Parts, Reading, Stations, log_uniform, read_at_rest
from tests.benchmarks.world.moving import joined, line_over, moving_rig, read, smooth_strokes
from tests.benchmarks.world.rig import Array, Hidden, Rig
from tests.benchmarks.world.rows.iso_cycles import draw_stations


def draw(rng: np.random.Generator) -> Rig:
    """Draw a table with one of the four effects."""
    return (_place_dependent_play, _run_in, _stairs, _dry_damping)[int(rng.integers(4))](rng)


def _up(stations: Stations) -> Array:
    way = np.diff(stations.position_mm, prepend=stations.position_mm[0] - 1)
    return np.where(way > 0, 1.0, -1.0)


def _place_dependent_play(rng: np.random.Generator) -> Rig:
    stations, targets = draw_stations(rng)
    noise = log_uniform(rng, 0.0002, 0.002)
    z = (stations.position_mm - targets[0]) / np.ptp(targets)
    shape = z if rng.random() < 0.5 else np.exp(-(((z - rng.uniform(0.3, 0.7)) / 0.15) ** 2))
    widths = noise * log_uniform(rng, 15.0, 60.0) * (0.2 + shape)
    place = stations.position_mm - _up(stations) * widths / 2
    reading = Reading(noise, 1e-6, float(np.ceil(2 - targets[0] + 0.1)), kind="play along the place")
    rig = read_at_rest(rng, stations, Parts(), reading, place)
    part = Hidden("backlash", {"play_mm": float(widths.mean())})
    return replace(rig, hidden=(part,), outside="play that depends on the place")


def _run_in(rng: np.random.Generator) -> Rig:
    stations, targets = draw_stations(rng)
    noise = log_uniform(rng, 0.0002, 0.002)
    cycle = np.cumsum(np.concatenate([[0.0], (np.diff(_up(stations)) > 0)]))
    widths = noise * log_uniform(rng, 15.0, 60.0) * (0.3 + np.exp(-cycle / rng.uniform(0.5, 1.5)))
    place = stations.position_mm - _up(stations) * widths / 2
    reading = Reading(noise, 1e-6, float(np.ceil(2 - targets[0] + 0.1)), kind="run-in of the play")
    rig = read_at_rest(rng, stations, Parts(), reading, place)
    part = Hidden("backlash", {"play_mm": float(widths.mean())})
    return replace(rig, hidden=(part,), outside="run-in: the play shrinks over the first cycles")


def _stairs(rng: np.random.Generator) -> Rig:
    width, rate = log_uniform(rng, 1.0, 5.0), 20.0
    corners = width * np.array([0.0, 1.0, 0.2, 0.8])
    motion = joined([smooth_strokes(corners, width / rng.uniform(8, 15), rate)])
    band = width / rng.uniform(25, 60)
    edges = np.cumsum(band * rng.uniform(0.4, 1.6, 400)) - 100 * band
    lower = np.searchsorted(edges, motion.input_mm)
    share = float(rng.uniform(0.5, 0.9))
    place = (1 - share) * motion.input_mm + share * (edges[lower - 1] + edges[lower]) / 2
    gap, sd = read(rng, 3.0 + place, band * float(rng.uniform(0.01, 0.05)), 1e-6)
    return moving_rig(
        motion, motion.input_mm, 3.0 + place, gap, line_over(motion.input_mm, 3.0), (), noise_mm=sd,
        kind="stairs", outside="dead-band stairs of uneven width",
    )  # fmt: skip


def _dry_damping(rng: np.random.Generator) -> Rig:
    width, rate = log_uniform(rng, 1.0, 5.0), float(rng.choice([20.0, 50.0]))
    corners = width * np.array([0.0, 1.0, 0.1, 0.7, 0.3])
    runs = [smooth_strokes(corners, width / s, rate, 1.0) for s in (rng.uniform(1.0, 2.0), rng.uniform(4, 8))]
    motion = joined(runs)
    size = width * float(rng.uniform(0.005, 0.02))
    place = motion.input_mm.copy()
    for rows in motion.parts():
        speed = np.gradient(motion.input_mm[rows], motion.time_s[rows])
        top = width / 1.5
        place[rows] -= size * np.sign(speed) * (np.abs(speed) / top) ** float(rng.uniform(2.0, 3.0))
    noise = size / float(rng.uniform(10, 40))
    gap, sd = read(rng, 3.0 + place, noise, 1e-6)
    return moving_rig(
        motion, motion.input_mm, 3.0 + place, gap, line_over(motion.input_mm, 3.0), (), noise_mm=sd,
        kind="dry damping", outside="damping that grows faster than the speed",
    )  # fmt: skip

"""Forty to a hundred readings at rest, seconds apart, without other rows; one effect or none."""

from dataclasses import replace

import numpy as np

from tests.benchmarks.world.at_rest import Parts, Reading, Stations, log_uniform, read_at_rest
from tests.benchmarks.world.error_map import draw_map
from tests.benchmarks.world.rig import Rig
from tests.benchmarks.world.rows.iso_cycles import draw_reading, draw_targets

KINDS = ("null", "offset", "scale", "play", "map")


def _up_and_down(rng: np.random.Generator, both: bool) -> tuple[Stations, np.ndarray]:
    targets = draw_targets(rng)
    visits = int(rng.integers(40, 101)) // targets.size
    position, run = [], []
    for k in range(visits):
        position += (targets[::-1] if both and k % 2 else targets).tolist()
        run += [0 if both else k] * targets.size
    dwell_s = float(rng.uniform(2, 60))
    time = dwell_s * np.arange(len(position))
    all_of_it = np.ones(len(position), dtype=bool)
    return Stations(np.array(position), time, np.array(run, dtype=np.int64), all_of_it, all_of_it), targets


def draw(rng: np.random.Generator) -> Rig:
    """Table of a motorised stage, or of a stage that is set by hand."""
    both = bool(rng.random() < 0.6)
    stations, targets = _up_and_down(rng, both)
    kind = str(rng.choice(KINDS))
    reading = draw_reading(rng, targets, "line", zeroed=False, kind=f"{kind}, {'both ways' if both else 'one way'}")
    return read_at_rest(rng, stations, one_part(rng, kind, reading, targets), reading)


def one_part(rng: np.random.Generator, kind: str, reading: Reading, targets: np.ndarray) -> Parts:
    """A single effect, 2 to 30 times the noise of a reading."""
    size = reading.noise_mm * log_uniform(rng, 2.0, 30.0)
    sign = float(rng.choice([-1, 1]))
    parts = Parts(start=float(rng.choice([-1.0, 1.0, rng.uniform(-1, 1)])))
    match kind:
        case "offset":
            parts = replace(parts, offset_mm=sign * size)
        case "scale":
            parts = replace(parts, ratio=sign * 2 * size / float(np.max(np.abs(targets))))
        case "play":
            parts = replace(parts, play_mm=min(2 * size, 0.4))
        case "map":
            parts = replace(parts, error_map=draw_map(rng, targets, size, int(rng.integers(2, 5))))
    return parts

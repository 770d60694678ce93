"""ISO 230-2 cycles of a linear stage measured with a laser: both directions, overshoots as rows without a gap."""

import numpy as np

from tests.benchmarks.world.at_rest import Parts, Reading, Stations, bidirectional, log_uniform, read_at_rest
from tests.benchmarks.world.error_map import draw_map
from tests.benchmarks.world.physics import rounded
from tests.benchmarks.world.rig import Array, Rig


def draw_targets(rng: np.random.Generator) -> Array:
    """Five to eleven targets, evenly spaced, or with the random shifts that ISO 230-2 requires."""
    travel = log_uniform(rng, 8.0, 300.0)
    count = int(rng.integers(5, 12))
    low = float(rng.choice([0.0, -travel / 2, 0.05 * travel]))
    spacing = travel / (count - 1)
    shifts = rng.uniform(-0.15, 0.15, count) * spacing if rng.random() < 0.3 else np.zeros(count)
    return rounded(low + spacing * np.arange(count) + shifts, 0.01)


def draw_stations(rng: np.random.Generator, *, listed: bool = True) -> tuple[Stations, Array]:
    """Stations of ISO 230-2 cycles, and their targets."""
    targets = draw_targets(rng)
    dwell_s, move_s = float(rng.uniform(5, 40)), float(rng.uniform(4, 8))
    if rng.random() < 0.3:
        dwell_s, move_s = np.round(dwell_s), np.round(move_s)
    overshoot = max(0.1, round(float(rng.uniform(0.1, 0.5) * (targets[1] - targets[0])), 2))
    return bidirectional(targets, int(rng.integers(3, 11)), overshoot, dwell_s, move_s, listed=listed), targets


def draw_parts(rng: np.random.Generator, stations: Stations, targets: Array, *, play: float, bent: float,
               warm: float, scaled: float) -> Parts:  # fmt: skip
    """Errors of a stage, each present with a given probability."""
    total_s = float(np.ptp(stations.time_s))
    sizes = {"error_map": None}
    if rng.random() < bent:
        sizes["error_map"] = draw_map(rng, targets, log_uniform(rng, 0.002, 0.04), int(rng.integers(2, 7)))
    warming = rng.random() < warm
    return Parts(
        play_mm=log_uniform(rng, 0.001, 0.06) if rng.random() < play else 0.0,
        start=float(rng.choice([-1.0, 1.0, rng.uniform(-1, 1)])),
        error_map=sizes["error_map"],
        ratio=float(rng.choice([-1, 1])) * log_uniform(rng, 2e-5, 5e-4) if rng.random() < scaled else 0.0,
        drift_mm=float(rng.choice([-1, 1])) * log_uniform(rng, 0.002, 0.04) if warming else 0.0,
        drift_tau_s=float(np.clip(total_s * rng.uniform(0.2, 1.5), 10.0, 2800.0)),
    )


def draw_reading(rng: np.random.Generator, targets: Array, simulation: str, *, zeroed: bool, kind: str) -> Reading:
    """Noise and last digit of a laser."""
    noise = log_uniform(rng, 0.0002, 0.005)
    resolution = float(rng.choice([1e-6, 1e-5, 1e-4, 1e-3]))
    resolution = min(resolution, 10 ** np.floor(np.log10(noise)))
    return Reading(noise, resolution, float(np.ceil(2 - targets[0] + 0.1)), simulation, zeroed, 0.0, kind)


def draw(rng: np.random.Generator) -> Rig:
    """Table of one stage; a fifth of the tables are without an effect."""
    stations, targets = draw_stations(rng)
    simulation = str(rng.choice(["line", "map"]))
    nothing = rng.random() < 0.2
    chances = (0.0, 0.0, 0.0, 0.0) if nothing else (0.85, 0.5, 0.3, 0.2 if simulation == "line" else 0.0)
    play, bent, warm, scaled = chances
    parts = draw_parts(rng, stations, targets, play=play, bent=bent, warm=warm, scaled=scaled)
    zeroed = bool(simulation == "line" and not nothing and rng.random() < 0.5)
    reading = draw_reading(rng, targets, simulation, zeroed=zeroed, kind=f"{simulation}{', zeroed' if zeroed else ''}")
    return read_at_rest(rng, stations, parts, reading)

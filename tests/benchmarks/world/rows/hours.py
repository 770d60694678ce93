"""Hours of sparse readings during a warming, or with slowly varying reading noise only."""

import numpy as np

from tests.benchmarks.world.at_rest import Parts, Reading, Stations, log_uniform, read_at_rest
from tests.benchmarks.world.rig import Rig


def draw(rng: np.random.Generator) -> Rig:
    """A few positions in turn, minutes apart; a third of the tables have slow noise only."""
    count = int(rng.integers(60, 160))
    every_s = float(rng.uniform(40, 200))
    places = np.linspace(0, log_uniform(rng, 1.0, 50.0), int(rng.integers(2, 6))).round(3)
    turn = np.concatenate([places, places[-2:0:-1]])
    position = np.resize(turn, count)
    if rng.random() < 0.3:
        position = rng.choice(places, count)
    all_of_it = np.ones(count, dtype=bool)
    stations = Stations(position, every_s * np.arange(count), np.zeros(count, dtype=np.int64), all_of_it, all_of_it)
    noise = log_uniform(rng, 0.0003, 0.003)
    if rng.random() < 0.35:
        wandering = Reading(noise, 1e-5, 3.0, correlation=float(rng.uniform(0.3, 0.85)), kind="null, slow noise")
        return read_at_rest(rng, stations, Parts(), wandering)
    tau = float(np.clip(every_s * count * rng.uniform(0.1, 0.6), 100.0, 2900.0))
    size = float(rng.choice([-1, 1])) * noise * log_uniform(rng, 5.0, 40.0)
    play = noise * log_uniform(rng, 3.0, 20.0) if rng.random() < 0.3 else 0.0
    parts = Parts(play_mm=play, start=-1.0, drift_mm=size, drift_tau_s=tau)
    return read_at_rest(rng, stations, parts, Reading(noise, 1e-5, 3.0, kind="drift"))

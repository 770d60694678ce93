"""Slits measured against a resolver: a sweep in both directions, then positions approached repeatedly from both sides.

Play or wind-up is 0.3 to 3 um, the noise 0.03 um; readings have four digits.
"""

import numpy as np

from tests.benchmarks.world.at_rest import Parts, Reading, Stations, log_uniform, read_at_rest
from tests.benchmarks.world.rig import Rig


def _stations(rng: np.random.Generator) -> Stations:
    high = float(rng.choice([30.0, 60.0, 90.0]))
    targets = np.linspace(high / 12, high, 12).round(3)
    back = 0.5
    dwell_s = float(rng.choice([4.0, 8.0, 12.0]))
    runs: list[list[tuple[float, bool]]] = []
    sweep = [(targets[0] - back, False), *((p, True) for p in targets), (targets[-1] + back, False)]
    runs.append([*sweep, *((p, True) for p in targets[::-1])])
    times = int(rng.integers(5, 11))
    for place in rng.choice(targets[1:-1], 3, replace=False):
        below, above = (float(place) - back, False), (float(place) + back, False)
        here = (float(place), True)
        runs.append([s for _ in range(times) for s in (below, here)] + [s for _ in range(times) for s in (above, here)])
    rows = [(p, r, k, i * dwell_s) for k, run in enumerate(runs) for i, (p, r) in enumerate(run)]
    position, read, run, time = (np.array(column) for column in zip(*rows, strict=True))
    return Stations(position, time, run.astype(np.int64) + 1, read, np.ones(read.size, dtype=bool))


def draw(rng: np.random.Generator) -> Rig:
    """Table of one slit; a sixth of the tables are without an effect."""
    stations = _stations(rng)
    nothing = rng.random() < 0.16
    noise = float(rng.uniform(0.03, 0.06)) * 1e-3
    parts = Parts(
        play_mm=0.0 if nothing else log_uniform(rng, 0.3, 3.0) * 1e-3,
        start=-1.0,
        ratio=0.0 if nothing or rng.random() < 0.7 else float(rng.choice([-1, 1])) * log_uniform(rng, 2e-6, 4e-5),
        offset_mm=0.0 if nothing or rng.random() < 0.7 else float(rng.normal(0, 5e-4)),
    )
    return read_at_rest(
        rng,
        stations,
        parts,
        Reading(noise, float(rng.choice([1e-4, 1e-5])), 0.0, kind="null" if nothing else "wind-up"),
    )

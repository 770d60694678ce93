"""Only one direction of each cycle is read; the return has rows without a gap, or each cycle is a separate run."""

from dataclasses import replace

import numpy as np

from tests.benchmarks.world.at_rest import Stations, read_at_rest
from tests.benchmarks.world.rig import Rig
from tests.benchmarks.world.rows.iso_cycles import draw_reading, draw_stations
from tests.benchmarks.world.rows.sparse import one_part

KINDS = ("null", "play", "map", "scale", "offset", "drift")


def one_way(rng: np.random.Generator, stations: Stations, *, upward: bool, way_back: bool) -> Stations:
    """Readings in one direction only; without the return motion, each cycle is a run."""
    position = stations.position_mm
    rising = np.concatenate([[True], np.diff(position) > 0])
    wanted = stations.read & (rising == upward)
    if way_back:
        return replace(stations, read=wanted, listed=np.ones(position.size, dtype=bool))
    begins = np.concatenate([[False], wanted[1:] & ~wanted[:-1]])
    cycle = np.cumsum(begins)
    return replace(stations, run=cycle.astype(np.int64), read=wanted, listed=wanted)


def draw(rng: np.random.Generator) -> Rig:
    """Table in which a play is always engaged, so that it is equivalent to an offset."""
    stations, targets = draw_stations(rng)
    way_back = bool(rng.random() < 0.5)
    stations = one_way(rng, stations, upward=bool(rng.random() < 0.5), way_back=way_back)
    kind = str(rng.choice(KINDS))
    reading = draw_reading(rng, targets, "line", zeroed=False, kind=f"{kind}{', way back listed' if way_back else ''}")
    parts = replace(one_part(rng, kind, reading, targets), start=-1.0)
    if kind == "drift":
        total_s = float(np.ptp(stations.time_s))
        parts = replace(parts, drift_mm=float(rng.choice([-1, 1])) * reading.noise_mm * rng.uniform(5, 30),
                        drift_tau_s=float(np.clip(total_s * rng.uniform(0.2, 1.0), 10.0, 2800.0)))  # fmt: skip
    return read_at_rest(rng, stations, parts, reading)

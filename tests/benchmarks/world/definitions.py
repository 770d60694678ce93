"""The definitions in effects.md at the rows of a table, for the gap only.

Halves are symmetric, so that effects that move both points together (`camera_drift`, `assembly_asymmetry`) do not
change the gap. The play and the sliders share one start state per run, from -1 to 1. The effect `position_error_map` is
left out: it is linear in its curve, which is projected out for sets that contain the effect (`nearest.py`).
"""

import numpy as np

from tests.benchmarks.hidden import catalogue_chain as chain
from tests.benchmarks.hidden.catalogue_chain import RUN_START, Effects, Samples, extended
from tests.benchmarks.world.rig import Array, Path, Rig

NEEDS_MOTION = ("drive_lag", "camera_latency", "slew_limit", "structural_resonance")
"""Effects that do nothing if the set-up rests before each reading."""


def samples_of(path: Path) -> Samples:
    """Points of a path as samples of the chain of effects."""
    return Samples(path.input_mm, path.time_s, path.time_s - path.time_s[0], path.starts, path.at_rest)


def respond(rig: Rig, acting: Effects, start: Array) -> Array:
    """Gap at the rows with a reading."""
    path, own = rig.path, {**acting, RUN_START: start}
    if path.commanded and "drive_lag" in own:  # the path includes the dead time of a command
        path = path.delayed(own.pop("drive_lag")[0])
    if path.at_rest:
        own = {name: values for name, values in own.items() if name not in NEEDS_MOTION}
    table = rig.simulation
    model = extended(table.input_mm, table.gap_mm, np.zeros_like(table.gap_mm), None)
    return np.asarray(chain.respond(model, samples_of(path), own)[0][path.row][rig.read])

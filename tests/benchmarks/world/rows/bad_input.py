"""Tables with poor data: meaningless times, other units, wrong rows.

A right answer refuses the table with a sentence (exit code 1), or does not use the times; no effect may be named with
confidence.
"""

from dataclasses import replace

import numpy as np

from tests.benchmarks.world.at_rest import Parts, Stations, log_uniform, read_at_rest
from tests.benchmarks.world.rig import Rig
from tests.benchmarks.world.rows import free_start
from tests.benchmarks.world.rows.iso_cycles import draw_reading, draw_stations, draw_targets
from tests.benchmarks.world.rows.sparse import one_part

KINDS = ("equal times", "whole seconds", "one visit", "micrometres", "two thirds wrong")


def draw(rng: np.random.Generator) -> Rig:
    """Draw one of the five kinds of table."""
    kind = str(rng.choice(KINDS))
    match kind:
        case "equal times":
            rig = _stage(rng, kind)
            rig = replace(rig, time_s=np.zeros_like(rig.time_s))
        case "whole seconds":
            rig = free_start.draw(rng)
            rig = replace(rig, kind=kind, time_s=np.floor(rig.time_s))
        case "one visit":
            rig = _one_visit(rng, kind)
        case "micrometres":
            rig = _stage(rng, kind)
            rig = replace(rig, gap_mm=1000 * rig.gap_mm, clean_gap_mm=1000 * rig.clean_gap_mm, hidden=())
            rig = replace(rig, noise_mm=1000 * rig.noise_mm, outside="the gap is in micrometres")
        case _:
            rig = _mostly_wrong(rng, kind)
    return replace(rig, may_refuse=kind != "one visit")


def _stage(rng: np.random.Generator, kind: str) -> Rig:
    stations, targets = draw_stations(rng, listed=False)
    reading = draw_reading(rng, targets, "line", zeroed=False, kind=kind)
    return read_at_rest(rng, stations, one_part(rng, str(rng.choice(["offset", "scale"])), reading, targets), reading)


def _one_visit(rng: np.random.Generator, kind: str) -> Rig:
    """Thirty positions, each read once in one upward motion."""
    ends = draw_targets(rng)
    targets = np.linspace(ends[0], ends[-1], 30).round(3)
    seen = np.ones(targets.size, dtype=bool)
    time = float(rng.uniform(2, 30)) * np.arange(targets.size)
    stations = Stations(targets, time, np.zeros(targets.size, dtype=np.int64), seen, seen)
    reading = draw_reading(rng, targets, "line", zeroed=False, kind=kind)
    parts = one_part(rng, str(rng.choice(["null", "offset", "scale", "play"])), reading, targets)
    return read_at_rest(rng, stations, parts, reading)


def _mostly_wrong(rng: np.random.Generator, kind: str) -> Rig:
    """Table in which two of three rows have arbitrary values."""
    stations, targets = draw_stations(rng, listed=False)
    reading = draw_reading(rng, targets, "line", zeroed=False, kind=kind)
    rig = read_at_rest(rng, stations, Parts(), reading)
    wrong = rng.random(rig.gap_mm.size) < 2 / 3
    size = reading.noise_mm * log_uniform(rng, 30.0, 300.0)
    away = np.where(wrong, size * rng.standard_normal(wrong.size), 0.0)
    gap, clean = rig.gap_mm + away, rig.clean_gap_mm + away
    return replace(rig, gap_mm=gap, clean_gap_mm=clean, outside="two rows of three are wrong", may_agree=True)

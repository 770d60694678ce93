"""Designs of experiments (rich, ordinary, poor), as defined in section 5 of diagnosing.md."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tests.benchmarks.hidden.gripper_table import InputRange
from tests.benchmarks.hidden.motion import Motion, hold, sine, staircase, through, triangle

Kind = Literal["rich", "ordinary", "poor"]


@dataclass(frozen=True, slots=True)
class Design:
    """Runs of one experiment.

    Parameters
    ----------
    kind : str
        Rich: at least 4 runs and 1000 samples, two speeds, reversals, holds, closing. Ordinary: 2 runs, at least 200
        samples, one reversal. Poor: one one-way run of at most 40 samples.
    motions : tuple of Motion
        One motion per run.
    rate_hz : float
        Samples per second.
    time_restarts : bool
        Whether `time_s` restarts with each run.
    pause_s : float
        Time between runs, if the time does not restart.
    """

    kind: Kind
    motions: tuple[Motion, ...]
    rate_hz: float
    time_restarts: bool
    pause_s: float


def _speed(inputs: InputRange, seconds: float) -> float:
    return inputs.width_mm / seconds


def _rich_run(rng: np.random.Generator, inputs: InputRange, index: int, fast: bool) -> Motion:
    low, high = inputs.lower_mm, inputs.upper_mm
    seconds = rng.uniform(3.0, 5.0) if fast else rng.uniform(12.0, 18.0)
    speed = _speed(inputs, seconds)
    start = float(rng.uniform(-0.1, 0.1) * inputs.width_mm)
    if index % 4 == 0:
        path = through([start, high, low, start], speed).then(hold(start, rng.uniform(6, 12)))
        return path.then(through([start, low, start, 0.6 * high], speed * 2))
    if index % 4 == 1:
        levels = int(rng.integers(4, 7))
        up = staircase(0.9 * low, 0.9 * high, levels, rng.uniform(3, 6), _speed(inputs, 6.0))
        return up.then(staircase(0.9 * high, 0.5 * low, 3, 4.0, _speed(inputs, 8.0)))
    if index % 4 == 2:
        mean = (low + high) / 2
        swing = sine(mean, 0.45 * inputs.width_mm, rng.uniform(0.05, 0.12), 3)
        return swing.then(sine(mean, rng.uniform(0.1, 0.2) * inputs.width_mm, rng.uniform(0.2, 0.35), 4))
    loops = [start]
    for size in (1.0, 0.7, 0.45, 0.25, 0.12):
        loops += [size * high, size * low]
    return through(loops, speed * 1.5).then(hold(float(loops[-1]), rng.uniform(8, 15)))


def draw_design(rng: np.random.Generator, kind: Kind, inputs: InputRange) -> Design:
    """Draw random runs of one experiment within a range of inputs."""
    restarts = bool(rng.random() < 0.35)
    if kind == "rich":
        runs = int(rng.integers(4, 7))
        motions = tuple(_rich_run(rng, inputs, i, fast=bool(i % 2)) for i in range(runs))
        total_s = sum(m.duration_s for m in motions)
        rate = max(rng.uniform(5.0, 8.0), rng.uniform(1050, 1800) / total_s)
        return Design(kind, motions, rate, restarts, rng.uniform(2, 30))
    if kind == "ordinary":
        seconds = rng.uniform(8, 20)
        start = inputs.lower_mm * rng.uniform(0.6, 1.0)
        one = through([start, inputs.upper_mm * rng.uniform(0.8, 1), start], _speed(inputs, seconds))
        two = triangle(0.0, inputs.upper_mm * rng.uniform(0.8, 1), _speed(inputs, seconds), 1)
        total_s = one.duration_s + two.duration_s
        return Design(kind, (one, two), max(4.0, rng.uniform(210, 400) / total_s), restarts, rng.uniform(2, 30))
    count = int(rng.integers(15, 41))
    path = through([inputs.lower_mm, inputs.upper_mm], _speed(inputs, rng.uniform(10, 60)))
    # With a single run, the time cannot restart.
    return Design(kind, (path,), (count - 1) / path.duration_s, False, 0.0)


def unseen_motion(inputs: InputRange) -> Motion:
    """A run that occurs in no design: a slow loop, a hold and a fast small loop."""
    low, high = inputs.lower_mm, inputs.upper_mm
    path = through([0.0, 0.95 * low, 0.95 * high, 0.3 * high], _speed(inputs, 9.0)).then(hold(0.3 * high, 6.0))
    return path.then(through([0.3 * high, -0.1 * high, 0.5 * high, 0.2 * low], _speed(inputs, 8.0)))

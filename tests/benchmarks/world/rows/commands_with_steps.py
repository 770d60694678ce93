"""A servo that follows commands (steps, staircases and ramps) after a dead time and at a limited speed.

The input is the command at the time of each row; a step is commanded at the time of its row, not before.
"""

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import log_uniform
from tests.benchmarks.world.moving import Motion, line_over, moving_rig
from tests.benchmarks.world.rig import Array, Hidden, Path, Rig

CORNER_S = 1e-6
"""Duration (s) of a step of the command."""


def _command(rng: np.random.Generator, shape: str, size: float, hold_s: float, total_s: float, t: Array) -> Array:
    turn = np.floor(t / hold_s).astype(int)
    if shape == "square":
        return size * (turn % 2).astype(float)
    if shape == "staircase":
        levels = np.concatenate([np.arange(6), np.arange(4, 0, -1)]) / 5
        return size * levels[turn % levels.size]
    corners = np.arange(0.0, total_s + 2 * hold_s, hold_s)
    goals = np.resize(np.array([0.0, 1.0, 1.0, 0.3, 0.3, 0.8, 0.0, 0.0]), corners.size) * size
    return np.interp(t, corners, goals)


def _path(time: Array, asked: Array, *, stepwise: bool) -> Path:
    """Path of the rows, with an additional corner at the old command before each step."""
    steps = np.flatnonzero(np.diff(asked)) + 1 if stepwise else np.zeros(0, dtype=int)
    every = np.concatenate([time, time[steps] - CORNER_S])
    order = np.argsort(every)
    u = np.concatenate([asked, asked[steps - 1]])[order]
    row = np.flatnonzero(order < time.size)
    if not stepwise:
        u = np.interp(every[order], time, asked)
    return Path(every[order], u, row, np.array([0, every.size]), at_rest=False, commanded=True)


def draw(rng: np.random.Generator) -> Rig:
    """Dead time with or without a limit of speed; a tenth of the tables are without an effect."""
    rate = float(rng.uniform(10, 50))
    count = int(rng.integers(250, 700))
    time = (np.arange(count) + rng.uniform(-0.02, 0.02, count)) / rate
    time -= time[0]
    shape = str(rng.choice(["square", "square", "staircase", "ramps"]))
    size = log_uniform(rng, 1.0, 10.0)
    hold_s = float(rng.uniform(1.0, 3.0))
    asked = _command(rng, shape, size, hold_s, float(time[-1]), time)
    # Between two rows, the command is constant for steps, and continues for ramps.
    stepwise = shape != "ramps"
    path = _path(time, asked, stepwise=stepwise)
    nothing = rng.random() < 0.1
    delay = 0.0 if nothing else log_uniform(rng, 0.05, 0.5)
    limited = not nothing and rng.random() < 0.75
    fastest = size / hold_s if shape == "ramps" else size
    speed = fastest * float(rng.uniform(1.3, 8.0))
    after = path.delayed(delay)
    followed = after.input_mm
    hidden: tuple[Hidden, ...] = () if nothing else (Hidden("drive_lag", {"delay_s": delay}),)
    if limited:
        followed = physics.at_limited_speed(after.time_s, followed, speed)
        hidden += (Hidden("slew_limit", {"speed_mm_s": speed}),)
    ratio = float(rng.choice([-1, 1])) * log_uniform(rng, 0.004, 0.03) if rng.random() < 0.2 and not nothing else 0.0
    if ratio:
        followed = followed * (1 + ratio)
        hidden += (Hidden("lever_ratio_error", {"ratio": ratio}),)
    noise, counts = float(rng.uniform(0.0, 0.6)), log_uniform(rng, 0.001, 0.01)
    zero = 1.0
    clean = zero + followed[after.row]
    gap = physics.rounded(clean + noise * counts * rng.standard_normal(count), counts)
    run = np.zeros(count, dtype=np.int64)
    return moving_rig(
        Motion(time, asked, run), asked, clean, gap, line_over(asked, zero), hidden,
        noise_mm=counts * float(np.hypot(noise, 1 / np.sqrt(12))), kind="null" if nothing else shape, path=path,
        exact_forms=not stepwise,
        note="Commands change at their line of the log and are held until the next." if stepwise else "",
    )  # fmt: skip

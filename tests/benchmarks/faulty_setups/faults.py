"""Good benches at random, and one function for every fault: what it does to a good bench.

Sizes are those at which somebody at the bench would say what is wrong: each costs the gap at least about 0.03 px.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.benchmarks.faulty_setups.bench import Bench

Rng = np.random.Generator


def good(rng: Rng) -> Bench:
    """A bench with nothing wrong: sharp, light, quiet, filled, square."""
    return Bench(
        gap_px=rng.uniform(60.0, 105.0),
        width_px=rng.uniform(90.0, 110.0),
        radius_px=rng.uniform(4.0, 30.0),
        spread_deg=rng.uniform(-2.0, 2.0),
        step_px=rng.choice([0.0, rng.uniform(0.0, 0.8)]),
        ground=rng.uniform(0.65, 0.85),
        finger=rng.uniform(0.06, 0.16),
        noise=rng.uniform(1.0, 2.5) / 255.0,
        texture=rng.choice([0.0, rng.uniform(0.01, 0.04)]),
        blur_px=rng.uniform(0.7, 1.1),
        turn_deg=rng.uniform(-0.5, 0.5),
        tilt_deg=rng.uniform(-1.0, 1.0),
    )


def focus(bench: Bench, rng: Rng) -> Bench:
    return replace(bench, blur_px=rng.uniform(3.0, 6.5))


def exposure(bench: Bench, rng: Rng) -> Bench:
    if rng.random() < 0.5:
        return replace(bench, ground=rng.uniform(1.03, 1.5))
    share = rng.uniform(0.05, 0.3)
    return replace(bench, ground=bench.ground * share, finger=bench.finger * share)


def gamma(bench: Bench, rng: Rng) -> Bench:
    return replace(bench, gamma=rng.uniform(1.8, 2.4))


def compression(bench: Bench, rng: Rng) -> Bench:
    return replace(bench, jpeg=int(rng.integers(10, 40)))


def motion(bench: Bench, rng: Rng) -> Bench:
    return replace(bench, motion_px=rng.uniform(4.0, 11.0))


def light(bench: Bench, rng: Rng) -> Bench:
    how = rng.integers(3)
    if how == 0:
        return replace(bench, finger=bench.ground - rng.uniform(0.06, 0.15))
    if how == 1:
        return replace(bench, noise=rng.uniform(10.0, 24.0) / 255.0)
    return replace(bench, ground=0.55, bright=rng.uniform(0.35, 0.6), bright_px=rng.uniform(0.35, 0.5) * bench.gap_px)


def tilt(bench: Bench, rng: Rng) -> Bench:
    sign = rng.choice([-1.0, 1.0])
    if rng.random() < 0.5:
        return replace(bench, turn_deg=sign * rng.uniform(3.0, 9.0))
    return replace(bench, tilt_deg=sign * rng.uniform(6.0, 20.0))


def scale(bench: Bench, rng: Rng) -> Bench:
    return replace(bench, zoom=1.0 / rng.uniform(2.5, 4.0))


def vibration(bench: Bench, rng: Rng) -> Bench:
    return replace(bench, shake_px=np.exp(rng.uniform(np.log(0.2), np.log(4.0))))


FAULTS: dict[str, Callable[[Bench, Rng], Bench]] = {
    function.__name__: function
    for function in (focus, exposure, gamma, compression, motion, light, tilt, scale, vibration)
}

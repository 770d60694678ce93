"""Set-ups that are read in motion, ten to fifty times a second."""

import itertools
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.rig import Array, Hidden, Integers, Path, Rig, Simulation


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Samples of one or more runs: true input, times (which may restart) and run numbers, each of shape (n,)."""

    time_s: Array
    input_mm: Array
    run: Integers

    def parts(self) -> list[slice]:
        """Rows of each run."""
        ends = [0, *(np.flatnonzero(np.diff(self.run)) + 1).tolist(), self.run.size]
        return [slice(a, b) for a, b in itertools.pairwise(ends)]


def smooth_strokes(corners_mm: Array, speed_mm_s: float, rate_hz: float, rest_s: float = 0.0) -> tuple[Array, Array]:
    """Times and positions of strokes between reversals, with constant acceleration and deceleration."""
    time, place = [np.zeros(1)], [np.array([corners_mm[0]])]
    now = 0.0
    for a, b in itertools.pairwise(corners_mm):
        duration = max(1.2 * abs(b - a) / speed_mm_s, 2 / rate_hz)
        count = max(2, round(duration * rate_hz))
        z = np.arange(1, count + 1) / count
        ramp = 1 / 6
        top = 1 / (1 - ramp)
        way = np.where(z < ramp, top * z**2 / (2 * ramp), top * (z - ramp / 2))
        way = np.where(z > 1 - ramp, 1 - top * (1 - z) ** 2 / (2 * ramp), way)
        time.append(now + count / rate_hz * z)
        place.append(a + (b - a) * way)
        now += count / rate_hz
        still = round(rest_s * rate_hz)
        if still:
            time.append(now + np.arange(1, still + 1) / rate_hz)
            place.append(np.full(still, b))
            now += still / rate_hz
    return np.concatenate(time), np.concatenate(place)


def joined(runs: list[tuple[Array, Array]]) -> Motion:
    """Join runs; the time restarts with each run."""
    run = np.concatenate([np.full(t.size, k + 1) for k, (t, _) in enumerate(runs)])
    return Motion(np.concatenate([t for t, _ in runs]), np.concatenate([u for _, u in runs]), run.astype(np.int64))


def moving_rig(
    motion: Motion,
    recorded_mm: Array,
    clean_mm: Array,
    gap_mm: Array,
    simulation: Simulation,
    hidden: tuple[Hidden, ...],
    *,
    noise_mm: float,
    kind: str,
    path: Path | None = None,
    **more: object,
) -> Rig:
    """Compose a table in which every row has a reading."""
    return Rig(
        kind=kind,
        run=motion.run,
        time_s=motion.time_s,
        input_mm=recorded_mm,
        gap_mm=gap_mm,
        read=np.ones(motion.run.size, dtype=bool),
        clean_gap_mm=clean_mm,
        noise_mm=noise_mm,
        simulation=simulation,
        path=path or Path.of_rows(motion.time_s, motion.input_mm, motion.run, at_rest=False),
        hidden=hidden,
        **more,  # type: ignore[arg-type]
    )


def line_over(u_mm: Array, gap_at_zero_mm: float, slope: float = 1.0) -> Simulation:
    """Straight-line simulation over a range slightly larger than that of the inputs."""
    reach = 0.1 * float(np.ptp(u_mm)) + 1e-3
    ends = np.array([u_mm.min() - reach, u_mm.max() + reach])
    return Simulation(ends, gap_at_zero_mm + slope * ends)


def read(rng: np.random.Generator, clean_mm: Array, noise_mm: float, resolution_mm: float) -> tuple[Array, float]:
    """Simulated readings, and their standard deviation including rounding."""
    gap = physics.rounded(clean_mm + noise_mm * rng.standard_normal(clean_mm.size), resolution_mm)
    return gap, float(np.hypot(noise_mm, resolution_mm / np.sqrt(12)))

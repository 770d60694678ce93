"""Motions of a stage: triangle, staircase with holds, sine, hold, move; as its position on a fine grid of time."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ACCELERATION_TIME_S = 0.5
"""A stage needs this long to come to its speed; corners are rounded by it."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Way points: the stage is at `position_mm[i]` at `time_s[i]`, or swings as a sine in between.

    Parameters
    ----------
    time_s, position_mm : tuple of float
        Corners of a path made of straight lines, the first at time 0.
    """

    time_s: tuple[float, ...]
    position_mm: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """Time of the last corner."""
        return self.time_s[-1]

    def at(self, time_s: Array) -> Array:
        """Position in mm, with rounded corners (mean over the time of acceleration), held before and after."""
        shifts = np.linspace(-0.5, 0.5, 13) * ACCELERATION_TIME_S
        return np.mean([np.interp(time_s + shift, self.time_s, self.position_mm) for shift in shifts], axis=0)

    def then(self, after: "Motion") -> "Motion":
        """This motion, then another; a jump between them is driven at 1 mm/s."""
        gap_s = max(abs(after.position_mm[0] - self.position_mm[-1]) / 1.0, 1e-3)
        start = self.duration_s + gap_s
        return Motion(self.time_s + tuple(start + t for t in after.time_s), self.position_mm + after.position_mm)


def through(points_mm: list[float], speed_mm_s: float) -> Motion:
    """Straight from point to point at one speed."""
    times = [0.0]
    for a, b in pairwise(points_mm):
        times.append(times[-1] + max(abs(b - a) / speed_mm_s, 1e-3))
    return Motion(tuple(times), tuple(points_mm))


def triangle(from_mm: float, to_mm: float, speed_mm_s: float, cycles: int) -> Motion:
    """There and back, `cycles` times."""
    return through([from_mm, *([to_mm, from_mm] * cycles)], speed_mm_s)


def staircase(from_mm: float, to_mm: float, steps: int, dwell_s: float, speed_mm_s: float) -> Motion:
    """Equal steps one way, with a hold on each level."""
    levels = np.linspace(from_mm, to_mm, steps + 1)
    times, positions = [0.0, dwell_s], [float(levels[0])] * 2
    for level in levels[1:]:
        times.append(times[-1] + max(abs(level - positions[-1]) / speed_mm_s, 1e-3))
        times.append(times[-1] + dwell_s)
        positions += [float(level)] * 2
    return Motion(tuple(times), tuple(positions))


def sine(mean_mm: float, amplitude_mm: float, frequency_hz: float, cycles: float) -> Motion:
    """A sine about a mean, as 64 straight pieces a cycle."""
    phase = np.linspace(0, 2 * np.pi * cycles, max(int(64 * cycles), 2))
    return Motion(tuple(phase / (2 * np.pi * frequency_hz)), tuple(mean_mm + amplitude_mm * np.sin(phase)))


def hold(at_mm: float, seconds: float) -> Motion:
    """Stand still."""
    return Motion((0.0, seconds), (at_mm, at_mm))

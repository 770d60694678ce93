"""Motions of a stage (triangle, staircase with holds, sine, hold, move) as positions on a fine time grid."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ACCELERATION_TIME_S = 0.5
"""Time of acceleration to the nominal speed, over which reversals are rounded."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion defined by corners: the stage is at `position_mm[i]` at `time_s[i]`.

    Parameters
    ----------
    time_s, position_mm : tuple of float
        Corners of a path of straight lines; the first corner is at time 0.
    """

    time_s: tuple[float, ...]
    position_mm: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """Time of the last corner."""
        return self.time_s[-1]

    def at(self, time_s: Array) -> Array:
        """Position (mm), with corners rounded by a mean over the acceleration time, constant before and after the
        motion.
        """
        shifts = np.linspace(-0.5, 0.5, 13) * ACCELERATION_TIME_S
        return np.mean([np.interp(time_s + shift, self.time_s, self.position_mm) for shift in shifts], axis=0)

    def then(self, after: "Motion") -> "Motion":
        """This motion followed by another motion; a jump between the two is replaced by a motion at 1 mm/s."""
        gap_s = max(abs(after.position_mm[0] - self.position_mm[-1]) / 1.0, 1e-3)
        start = self.duration_s + gap_s
        return Motion(self.time_s + tuple(start + t for t in after.time_s), self.position_mm + after.position_mm)


def through(points_mm: list[float], speed_mm_s: float) -> Motion:
    """Straight motion from point to point at one speed."""
    times = [0.0]
    for a, b in pairwise(points_mm):
        times.append(times[-1] + max(abs(b - a) / speed_mm_s, 1e-3))
    return Motion(tuple(times), tuple(points_mm))


def triangle(from_mm: float, to_mm: float, speed_mm_s: float, cycles: int) -> Motion:
    """Motion from one position to another and back, `cycles` times."""
    return through([from_mm, *([to_mm, from_mm] * cycles)], speed_mm_s)


def staircase(from_mm: float, to_mm: float, steps: int, dwell_s: float, speed_mm_s: float) -> Motion:
    """Equal steps in one direction, with a hold at each level."""
    levels = np.linspace(from_mm, to_mm, steps + 1)
    times, positions = [0.0, dwell_s], [float(levels[0])] * 2
    for level in levels[1:]:
        times.append(times[-1] + max(abs(level - positions[-1]) / speed_mm_s, 1e-3))
        times.append(times[-1] + dwell_s)
        positions += [float(level)] * 2
    return Motion(tuple(times), tuple(positions))


def sine(mean_mm: float, amplitude_mm: float, frequency_hz: float, cycles: float) -> Motion:
    """Sinusoidal motion about a mean position, in 64 straight pieces per cycle."""
    phase = np.linspace(0, 2 * np.pi * cycles, max(int(64 * cycles), 2))
    return Motion(tuple(phase / (2 * np.pi * frequency_hz)), tuple(mean_mm + amplitude_mm * np.sin(phase)))


def hold(at_mm: float, seconds: float) -> Motion:
    """Rest at a position."""
    return Motion((0.0, seconds), (at_mm, at_mm))

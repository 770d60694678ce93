"""Synchronisation of a camera's clock with the test bed's clock, from the arrival times of its frames.

A frame arrives at its exposure plus the smallest latency at the earliest, and some frames arrive hardly later. The
earliest arrivals therefore lie on a line, whose slope is the rate and whose intercept is the offset plus the smallest
latency. Arrival times alone cannot separate offset and latency, so that the smallest latency must be known (`Latency`
of the camera).
"""

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from fingervision.testbed.camera import Latency

# Duration of a bin: only the earliest arrival in each bin is used.
BIN_S = 1.0
# Standard deviation of the relative rate of two quartz clocks (data sheets: 30 parts per million each).
LIKELY_RATE = 3e-5
# Number of newest bins that give the offset, and of all bins, which give the rate.
NEWEST_BINS, MOST_BINS = 10, 600
# Assumed scatter, until the arrivals themselves show their scatter.
FIRST_SCATTER_S = 1e-3


@dataclass(frozen=True, slots=True)
class CameraClock:
    """The test bed's time as a linear function of the camera's time.

    Parameters
    ----------
    camera_s, bed_s : float
        Times of one instant on the two clocks.
    rate : float
        Seconds of the test bed's clock per second of the camera's.
    u_s : float
        Standard uncertainty near that instant, from the smallest latency and the scatter of the earliest arrivals.
    """

    camera_s: float
    bed_s: float
    rate: float
    u_s: float

    def bed_at(self, camera_s: float) -> float:
        """Time on the bed's clock at a time stamp of the camera (s)."""
        return self.bed_s + self.rate * (camera_s - self.camera_s)


class ArrivalClock:
    """Collects arrival times and fits the clock to the earliest.

    Parameters
    ----------
    latency : Latency
        Latency of the camera.
    """

    def __init__(self, latency: Latency) -> None:
        self._latency = latency
        # For each bin: its start, and the time stamp and delay of its earliest arrival.
        self._bins: list[tuple[float, float, float]] = []

    def add(self, camera_s: float, arrived_s: float) -> None:
        """Add the arrival of a frame."""
        delay_s = arrived_s - self._latency.least_s - camera_s
        if not self._bins or camera_s - self._bins[-1][0] > BIN_S:
            self._bins = [*self._bins[-MOST_BINS + 1 :], (camera_s, camera_s, delay_s)]
        elif delay_s < self._bins[-1][2]:
            self._bins[-1] = (self._bins[-1][0], camera_s, delay_s)

    def joined(self) -> CameraClock:
        """Fit the clock to all arrivals until now."""
        _, at_s, delay_s = np.array(self._bins).T
        about_s = float(at_s[-1])
        since_s = at_s - at_s.mean()
        # Scatter of the earliest arrivals from bin to bin: neighbouring bins hardly differ for any other reason.
        scatter_s = float(np.std(np.diff(delay_s))) / sqrt(2.0) if delay_s.size > 2 else FIRST_SCATTER_S
        # Ridge regression: the rate stays small where the arrivals determine it less well than the data sheets.
        rate = float(since_s @ delay_s) / float(since_s @ since_s + (scatter_s / LIKELY_RATE) ** 2 + 1e-12)
        level_s = (delay_s - rate * (at_s - about_s))[-NEWEST_BINS:]
        return CameraClock(about_s, about_s + float(level_s.min()), 1.0 + rate, hypot(self._latency.u_s, scatter_s))

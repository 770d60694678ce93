"""A camera's clock joined to the bed's by the arrivals of its frames.

A frame arrives no sooner than its exposure and the least latency, and now and then hardly later: the earliest arrivals
lie on a line, whose slope is the rate and whose height is the offset plus the least latency. Arrivals alone cannot tell
the two apart, so the least latency must be known (`Latency` of the camera).
"""

from dataclasses import dataclass
from math import hypot

import numpy as np

from fingervision.testbed.camera import Latency

# The earliest of so many seconds counts; two quartz clocks part by 0.3 ms meanwhile (twice 30 parts in a million).
BIN_S = 5.0
# From here on the rate is fitted.
RATE_AFTER_S = 20.0
# Twenty minutes; older ones say nothing of now that newer ones do not.
MOST_BINS = 240


@dataclass(frozen=True, slots=True)
class CameraClock:
    """The bed's time as a straight line over the camera's.

    Parameters
    ----------
    camera_s, bed_s : float
        An instant on both.
    rate : float
        Seconds of the bed in one of the camera's.
    u_s : float
        Standard uncertainty near that instant: that of the least latency, and the scatter of the earliest arrivals.
    """

    camera_s: float
    bed_s: float
    rate: float
    u_s: float

    def bed_at(self, camera_s: float) -> float:
        """Time of the bed at a stamp of the camera."""
        return self.bed_s + self.rate * (camera_s - self.camera_s)


class ArrivalClock:
    """Collects arrivals and fits the clock to the earliest.

    Parameters
    ----------
    latency : Latency
        Of the camera.
    """

    def __init__(self, latency: Latency) -> None:
        self._latency = latency
        # Of each bin: its beginning; stamp and delay of its earliest arrival; delay of the next earliest.
        self._bins: list[tuple[float, float, float, float]] = []

    def add(self, camera_s: float, arrived_s: float) -> None:
        """Take a frame."""
        delay_s = arrived_s - self._latency.least_s - camera_s
        if not self._bins or camera_s - self._bins[-1][0] > BIN_S:
            self._bins = [*self._bins[-MOST_BINS + 1 :], (camera_s, camera_s, delay_s, float("inf"))]
            return
        begin_s, at_s, first_s, second_s = self._bins[-1]
        if delay_s < first_s:
            self._bins[-1] = (begin_s, camera_s, delay_s, first_s)
        else:
            self._bins[-1] = (begin_s, at_s, first_s, min(second_s, delay_s))

    def joined(self) -> CameraClock:
        """Fit the clock to what came until now."""
        _, at_s, first_s, second_s = np.array(self._bins).T
        about_s, rate = float(at_s[-1]), 0.0
        if at_s[-1] - at_s[0] >= RATE_AFTER_S:
            rate = float(np.polyfit(at_s - about_s, first_s, 1)[0])
        level_s = first_s - rate * (at_s - about_s)
        lowest_s = float(np.min(level_s))
        spread_s = float(np.median(level_s) - lowest_s) if level_s.size > 1 else float(second_s[0] - first_s[0])
        u_s = hypot(self._latency.u_s, spread_s if np.isfinite(spread_s) else 0.0)
        return CameraClock(about_s, about_s + lowest_s, 1.0 + rate, u_s)

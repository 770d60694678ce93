"""The test bed's clock, and the synchronisation of a board's and a camera's clocks with it."""

from collections import deque
from dataclasses import dataclass
from math import hypot, sqrt
from time import monotonic, sleep
from typing import Protocol

import numpy as np

from fingervision.testbed.camera import Latency

# A paced clock makes up for a delay up to this duration.
MOST_HURRY_S = 0.05


class Clock(Protocol):
    """The test bed's time, to which every `asked_s`, `got_s` and `arrived_s` refers."""

    def now_s(self) -> float:
        """Seconds since a fixed instant."""
        ...

    def wait_until(self, time_s: float) -> None:
        """Wait until the given time; return at once if it is in the past."""
        ...


class HostClock:
    """The computer's monotonic clock, used for any test bed with a real part."""

    def now_s(self) -> float:
        """Seconds on the host's monotonic clock."""
        return monotonic()

    def wait_until(self, time_s: float) -> None:
        """Sleep until the given time."""
        left_s = time_s - monotonic()
        if left_s > 0.0:
            sleep(left_s)


class VirtualClock:
    """Clock of a completely simulated test bed: its time advances only while some part waits.

    With a pace, virtual time advances at most at this pace, and does not make up for long delays (a pause, a busy
    computer).

    Parameters
    ----------
    pace : float
        Seconds of the test bed per second of the computer: 1 is real time, 0 as fast as possible.
    begin_s : float
        Time at which the clock starts, as if that time had already passed.
    """

    def __init__(self, pace: float = 0.0, begin_s: float = 0.0) -> None:
        self._now_s = begin_s
        self.pace = pace
        self._host_began_s: float | None = None

    def now_s(self) -> float:
        """Seconds on the test bed's virtual clock."""
        return self._now_s

    def wait_until(self, time_s: float) -> None:
        """Let virtual time pass until `time_s`."""
        if time_s <= self._now_s:
            return
        if self.pace > 0.0:
            if self._host_began_s is None:
                self._host_began_s = monotonic() - self._now_s / self.pace
            left_s = self._host_began_s + time_s / self.pace - monotonic()
            # The time is set after the sleep: what another thread reads meanwhile is not ahead of the pace.
            if left_s > 0.0:
                sleep(left_s)
            elif left_s < -MOST_HURRY_S:
                self._host_began_s -= left_s
        self._now_s = max(self._now_s, time_s)


# Synchronisation of the clocks of a board and of a camera with the test bed's clock.
#
# The board records the time at which it receives a command; that time lies between the sending of the command and the
# arrival of the response (Cristian, "Probabilistic clock synchronization", Distributed Computing 3, 1989). Many
# exchanges of commands and responses narrow the interval: the clock rate is fitted to the midpoints, and the offset is
# the midpoint of the intersection of the intervals.
#
# A frame arrives at its exposure plus the smallest latency at the earliest, and some frames arrive hardly later. The
# earliest arrivals therefore lie on a line, whose slope is the rate and whose intercept is the offset plus the smallest
# latency. Arrival times alone cannot separate offset and latency, so that the smallest latency must be known (`Latency`
# of the camera).

# Exchanges older than this are not used, because the rate of a resonator drifts with its temperature.
WINDOW_S = 20.0
FEWEST = 5
# Share of the bounds, the tightest ones, that is left out. This only widens the remaining interval, and protects it
# against a single wrong exchange.
LEFT_OUT = 0.25
# An instrument without its own clock uses the host's clock: its exchanges have no width.
AT_ONCE_S = 1e-9
# Limit of the rate of an unknown clock: ceramic resonators on Arduinos have 0.5 % initial tolerance and 0.3 % over
# temperature (Murata, CSTNE16M0V53).
UNKNOWN_RATE = 0.008


@dataclass(frozen=True, slots=True)
class JoinedClock:
    """The computer's time as a linear function of a board's or a camera's time, valid near what it was fitted to.

    Parameters
    ----------
    board_s : float
        Time of the board in the middle of the exchanges, or of the camera.
    host_s : float
        Time of the computer at that instant.
    rate : float
        Seconds of the computer per second of the board.
    within_s : float
        Bound of the error of `host_s`; a uniform distribution within it has its standard uncertainty.
    u_rate : float
        Standard uncertainty of the rate; 0 for a camera, whose frames are near.
    """

    board_s: float
    host_s: float
    rate: float
    within_s: float
    u_rate: float

    def host_at(self, board_s: float) -> float:
        """Time of the host computer (s) at a given time of the board."""
        return self.host_s + self.rate * (board_s - self.board_s)

    def u_at(self, board_s: float) -> float:
        """Standard uncertainty of `host_at` (s): uniform within its bounds, combined with that of the clock rate."""
        return hypot(self.within_s / sqrt(3.0), self.u_rate * (board_s - self.board_s))

    def bounds_at(self, board_s: float) -> tuple[float, float]:
        """Bounds of the host time (s) at a given time of the board, widened by three u of the fitted clock rate."""
        half_s = self.within_s + 3.0 * self.u_rate * abs(board_s - self.board_s)
        return self.host_at(board_s) - half_s, self.host_at(board_s) + half_s


class ClockJoin:
    """Collects exchanges and fits the clock to the newest ones."""

    def __init__(self) -> None:
        self._exchanges: deque[tuple[float, float, float]] = deque()

    def add(self, board_s: float, earliest_s: float, latest_s: float) -> None:
        """Add an exchange: the board's time stamp, and the computer's times between which it was taken."""
        self._exchanges.append((board_s, earliest_s, max(latest_s, earliest_s)))
        while self._exchanges[-1][1] - self._exchanges[0][1] > WINDOW_S:
            self._exchanges.popleft()

    def joined(self) -> JoinedClock | None:
        """Fit the clock; None before there are enough exchanges."""
        if len(self._exchanges) < FEWEST:
            return None
        board_s, earliest_s, latest_s = np.array(self._exchanges).T
        middle_s, half_s = 0.5 * (earliest_s + latest_s), 0.5 * (latest_s - earliest_s)
        # Delayed exchanges carry little information: the narrowest exchanges have the largest weights.
        weights = 1.0 / (half_s + np.median(half_s) + AT_ONCE_S) ** 2
        weights /= weights.sum()
        at_s = float(weights @ board_s)
        since_s = board_s - at_s
        lever_s2 = float(weights @ since_s**2)
        rate, u_rate = 1.0, UNKNOWN_RATE
        if lever_s2 > 0.0:
            # The midpoints are assumed to have independent errors, uniform within their half widths.
            fitted_u = sqrt(float(weights**2 @ (since_s**2 * half_s**2)) / 3.0) / lever_s2
            if fitted_u < UNKNOWN_RATE:
                rate, u_rate = float(weights @ (since_s * (middle_s - middle_s.mean()))) / lever_s2, fitted_u
        lowest_s = float(np.quantile(earliest_s - rate * since_s, 1.0 - LEFT_OUT))
        highest_s = float(np.quantile(latest_s - rate * since_s, LEFT_OUT))
        # If the rate has changed, no straight line satisfies all bounds. The bounds then cross, and their distance is
        # the deviation from a line.
        return JoinedClock(at_s, 0.5 * (lowest_s + highest_s), rate, 0.5 * abs(highest_s - lowest_s), u_rate)


# Duration of a bin: only the earliest arrival in each bin is used.
BIN_S = 1.0
# Standard deviation of the relative rate of two quartz clocks (data sheets: 30 parts per million each).
LIKELY_RATE = 3e-5
# Number of newest bins that give the offset, and of all bins, which give the rate.
NEWEST_BINS, MOST_BINS = 10, 600
# Assumed scatter, until the arrivals themselves show their scatter.
FIRST_SCATTER_S = 1e-3


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

    def joined(self) -> JoinedClock:
        """Fit the clock to all arrivals until now, by the smallest latency and the scatter of the earliest."""
        _, at_s, delay_s = np.array(self._bins).T
        about_s = float(at_s[-1])
        since_s = at_s - at_s.mean()
        # Scatter of the earliest arrivals from bin to bin: neighbouring bins hardly differ for any other reason.
        scatter_s = float(np.std(np.diff(delay_s))) / sqrt(2.0) if delay_s.size > 2 else FIRST_SCATTER_S
        # Ridge regression: the rate stays small where the arrivals determine it less well than the data sheets.
        rate = float(since_s @ delay_s) / float(since_s @ since_s + (scatter_s / LIKELY_RATE) ** 2 + 1e-12)
        level_s = (delay_s - rate * (at_s - about_s))[-NEWEST_BINS:]
        within_s = sqrt(3.0) * hypot(self._latency.u_s, scatter_s)
        return JoinedClock(about_s, about_s + float(level_s.min()), 1.0 + rate, within_s, 0.0)

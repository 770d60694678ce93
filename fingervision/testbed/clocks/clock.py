"""The test bed's clock: the computer's, or a virtual clock that advances with the simulation."""

from time import monotonic, sleep
from typing import Protocol

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

"""Synchronisation of the board's clock with the host's: offset and rate, with their uncertainty.

The board records the time at which it receives a command; that time lies between the sending of the command and the
arrival of the response (Cristian, "Probabilistic clock synchronization", Distributed Computing 3, 1989). Many exchanges
of commands and responses narrow the interval: the clock rate is fitted to the midpoints, and the offset is the midpoint
of the intersection of the intervals.
"""

from collections import deque
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

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
    """The computer's time as a linear function of the board's time, valid near the exchanges to which it was fitted.

    Parameters
    ----------
    board_s : float
        Time of the board in the middle of the exchanges.
    host_s : float
        Time of the computer at that instant.
    rate : float
        Seconds of the computer per second of the board.
    within_s : float
        Bound of the error of `host_s`.
    u_rate : float
        Standard uncertainty of the rate.
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

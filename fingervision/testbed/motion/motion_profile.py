"""Trapezoidal speed profile of one motion, and the position over time where no encoder is readable.

The formulas of the profile are those of uniformly accelerated motion. With equal acceleration and deceleration, a
triangular speed profile of distance s and time T has the peak speed v = 2 s / T and the acceleration a = 4 s / T^2; a
trapezoidal profile of top speed v takes T = s / v + v / a. The profile that a real controller uses for a block
specified by its cycle time is not published. Among the profiles that do not exceed the top speed, the assumed profile
has the least acceleration, and so the least force.
"""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.step_data import CycleTime, SpeedEntry

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MotionProfile:
    """One motion from rest to rest.

    Parameters
    ----------
    distance_mm : float
        Signed distance.
    speed_mm_s : float
        Peak speed, not negative.
    speeding_s, cruising_s, slowing_s : float
        Durations of acceleration, constant speed and deceleration, not negative.
    """

    distance_mm: float
    speed_mm_s: float
    speeding_s: float
    cruising_s: float
    slowing_s: float

    @property
    def seconds(self) -> float:
        """Duration from rest to rest."""
        return self.speeding_s + self.cruising_s + self.slowing_s

    @property
    def acceleration_mm_s2(self) -> float:
        """Acceleration at the beginning (mm/s²); 0 without a motion."""
        return self.speed_mm_s / self.speeding_s if self.speeding_s > 0.0 else 0.0

    @property
    def deceleration_mm_s2(self) -> float:
        """Deceleration at the end (mm/s²); 0 without a motion."""
        return self.speed_mm_s / self.slowing_s if self.slowing_s > 0.0 else 0.0

    def speeds_mm_s(self, time_s: Floats) -> Floats:
        """Signed speed at times since the start (mm/s); 0 before and after the motion.

        Parameters
        ----------
        time_s : ndarray of float, shape (n,)
            Seconds since the start.

        Returns
        -------
        ndarray of float, shape (n,)
        """
        knots_s, knots_mm_s = self._knots()
        return np.interp(time_s, knots_s, knots_mm_s)

    def travelled_mm(self, time_s: Floats) -> Floats:
        """Signed distance covered at times since the start (mm): the integral of the speed.

        Parameters
        ----------
        time_s : ndarray of float, shape (n,)
            Seconds since the start.

        Returns
        -------
        ndarray of float, shape (n,)
        """
        sign = np.sign(self.distance_mm)
        up = np.clip(time_s, 0.0, self.speeding_s)
        level = np.clip(time_s - self.speeding_s, 0.0, self.cruising_s)
        down = np.clip(time_s - self.speeding_s - self.cruising_s, 0.0, self.slowing_s)
        way = 0.5 * self.acceleration_mm_s2 * up**2 + self.speed_mm_s * level
        way += self.speed_mm_s * down - 0.5 * self.deceleration_mm_s2 * down**2
        return np.asarray(sign * way, dtype=np.float64)

    def _knots(self) -> tuple[Floats, Floats]:
        peak_mm_s = np.sign(self.distance_mm) * self.speed_mm_s
        slowing_at_s = self.speeding_s + self.cruising_s
        return np.array([0.0, self.speeding_s, slowing_at_s, self.seconds]), np.array([0.0, peak_mm_s, peak_mm_s, 0.0])


def shortest_s(distance_mm: float, top_speed_mm_s: float, top_acceleration_mm_s2: float) -> float:
    """Shortest duration from rest to rest within a top speed and a top acceleration (s).

    Examples
    --------
    >>> shortest_s(10.0, 400.0, 16000.0)
    0.05
    """
    way_mm = abs(distance_mm)
    if way_mm * top_acceleration_mm_s2 <= top_speed_mm_s**2:
        return 2.0 * sqrt(way_mm / top_acceleration_mm_s2)
    return way_mm / top_speed_mm_s + (top_speed_mm_s / top_acceleration_mm_s2 if top_acceleration_mm_s2 < inf else 0.0)


def profile(distance_mm: float, entry: CycleTime | SpeedEntry, top_speed_mm_s: float) -> MotionProfile:
    """Motion profile specified by a step data block.

    Parameters
    ----------
    distance_mm : float
        Signed distance.
    entry : CycleTime or SpeedEntry
        Timing of the motion. A positioning time must be longer than the distance takes at top speed.
    top_speed_mm_s : float
        Top speed of the stage; only needed for cycle-time entry, to choose the profile.
    """
    if isinstance(entry, CycleTime):
        return _in_time(distance_mm, entry.positioning_time_s, top_speed_mm_s)
    return _at_speed(distance_mm, entry)


def _in_time(distance_mm: float, seconds: float, top_speed_mm_s: float) -> MotionProfile:
    way_mm = abs(distance_mm)
    peak_mm_s = 2.0 * way_mm / seconds
    if peak_mm_s <= top_speed_mm_s:
        return MotionProfile(distance_mm, peak_mm_s, 0.5 * seconds, 0.0, 0.5 * seconds)
    speeding_s = seconds - way_mm / top_speed_mm_s
    return MotionProfile(distance_mm, top_speed_mm_s, speeding_s, seconds - 2.0 * speeding_s, speeding_s)


def _at_speed(distance_mm: float, entry: SpeedEntry) -> MotionProfile:
    way_mm, up, down = abs(distance_mm), entry.acceleration_mm_s2, entry.deceleration_mm_s2
    peak_mm_s = min(entry.speed_mm_s, sqrt(2.0 * way_mm * up * down / (up + down)))
    speeding_s, slowing_s = peak_mm_s / up, peak_mm_s / down
    cruising_mm = max(0.0, way_mm - 0.5 * peak_mm_s * (speeding_s + slowing_s))
    return MotionProfile(
        distance_mm, peak_mm_s, speeding_s, cruising_mm / peak_mm_s if peak_mm_s > 0.0 else 0.0, slowing_s
    )


# Position over time of an actuator without a readable encoder, computed from its motion profiles.


@dataclass(frozen=True, slots=True)
class _Piece:
    begin_s: float
    from_mm: float
    motion: MotionProfile
    # End of the motion; earlier than planned if the motion was interrupted.
    until_s: float


class CommandedPath:
    """Position over time, constant between motions.

    Parameters
    ----------
    at_mm : float
        Initial position.
    """

    def __init__(self, at_mm: float) -> None:
        self._pieces: list[_Piece] = [_Piece(-np.inf, at_mm, MotionProfile(0.0, 0.0, 0.0, 0.0, 0.0), np.inf)]

    def begin(self, begin_s: float, motion: MotionProfile) -> None:
        """Begin a motion at the position where the last one ended."""
        self._pieces.append(_Piece(begin_s, self.at_mm(begin_s), motion, np.inf))

    def jump(self, time_s: float, to_mm: float) -> None:
        """Set the position from a time on, after homing or after a turn by hand."""
        self._pieces.append(_Piece(time_s, to_mm, MotionProfile(0.0, 0.0, 0.0, 0.0, 0.0), np.inf))

    def break_off(self, time_s: float) -> None:
        """End the present motion at a time."""
        last = self._pieces[-1]
        self._pieces[-1] = _Piece(last.begin_s, last.from_mm, last.motion, max(time_s, last.begin_s))

    def at_mm(self, time_s: float) -> float:
        """Position at a time (mm)."""
        piece = next((each for each in reversed(self._pieces) if each.begin_s <= time_s), self._pieces[0])
        since_s = min(time_s, piece.until_s) - piece.begin_s
        return piece.from_mm + float(piece.motion.travelled_mm(np.array([since_s]))[0])

    def times_of_motion_s(self, from_s: float, to_s: float, every_s: float) -> Floats:
        """Times at intervals of `every_s`, between two times, at which the stage is in motion (s).

        Returns
        -------
        ndarray of float, shape (n,)
        """
        times = []
        for piece in self._pieces:
            end_s = min(to_s, piece.until_s, piece.begin_s + piece.motion.seconds)
            begin_s = max(from_s, piece.begin_s)
            if piece.motion.seconds > 0.0 and begin_s < end_s:
                times.append(np.arange(begin_s + every_s, end_s, every_s))
        found = np.concatenate(times) if times else np.empty(0)
        return found[found < to_s]

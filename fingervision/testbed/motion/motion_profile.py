"""Trapezoidal speed profile of one motion, and the position over time that follows from several motions.

The formulas of the profile are those of uniformly accelerated motion. With equal acceleration and deceleration, a
triangular speed profile of distance s and time T has the peak speed v = 2 s / T and the acceleration a = 4 s / T^2; a
trapezoidal profile of top speed v takes T = s / v + v / a. The profile that a real controller uses for a block
specified by its cycle time is not published. Among the profiles that do not exceed the top speed, the assumed profile
has the least acceleration, and so the least force.
"""

from dataclasses import dataclass
from math import copysign, inf, sqrt

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


# Position over time: that of the simulated stage, and of an actuator without a readable encoder.

Piece = tuple[float, float, float, float, float]
"""A piece of a path: start time, position and speed at the start, acceleration, duration."""


class MotionPath:
    """Position over time, for all past times and for the planned motion; constant between motions.

    Parameters
    ----------
    at_mm : float
        Initial position.
    """

    def __init__(self, at_mm: float) -> None:
        # This tuple is always replaced as a whole, because another thread may end a motion while this thread reads the
        # position.
        self._pieces: tuple[Piece, ...] = ((-inf, at_mm, 0.0, 0.0, 0.0),)
        self.version = 0

    @property
    def planned_until_s(self) -> float:
        """End of the present motion (s); minus infinity before the first motion."""
        begin_s, _, _, _, duration_s = self._pieces[-1]
        return begin_s + duration_s

    def begin(self, begin_s: float, motion: MotionProfile) -> None:
        """Begin a motion at the position of this time."""
        at_mm, sign = float(self.at_mm(begin_s)), copysign(1.0, motion.distance_mm)
        speed, up, down = (
            sign * each for each in (motion.speed_mm_s, motion.acceleration_mm_s2, -motion.deceleration_mm_s2)
        )
        pieces = self._until(begin_s)
        for at_first, acceleration, duration_s in (
            (0.0, up, motion.speeding_s), (speed, 0.0, motion.cruising_s), (speed, down, motion.slowing_s),
        ):  # fmt: skip
            pieces.append((begin_s, at_mm, at_first, acceleration, duration_s))
            at_mm += at_first * duration_s + 0.5 * acceleration * duration_s**2
            begin_s += duration_s
        self._replace(pieces)

    def jump(self, time_s: float, to_mm: float) -> None:
        """Set the position from a time on, after homing or where a motion has ended otherwise than planned."""
        self._replace([*self._until(time_s), (time_s, to_mm, 0.0, 0.0, 0.0)])

    def break_off(self, time_s: float, deceleration_mm_s2: float = inf) -> None:
        """End the present motion at a time, by a deceleration."""
        if time_s >= self.planned_until_s:
            return
        *before, (begin_s, from_mm, speed, acceleration, _) = self._until(time_s)
        since_s = time_s - begin_s
        at_mm, now_mm_s = from_mm + speed * since_s + 0.5 * acceleration * since_s**2, speed + acceleration * since_s
        braking_s, brake = abs(now_mm_s) / deceleration_mm_s2, -copysign(deceleration_mm_s2, now_mm_s)
        end = (time_s, at_mm, now_mm_s, brake, braking_s) if braking_s else (time_s, at_mm, 0.0, 0.0, 0.0)
        self._replace([*before, (begin_s, from_mm, speed, acceleration, since_s), end])

    def moves(self, time_s: Floats) -> NDArray[np.bool_]:
        """Whether a motion is in progress at the given times, shape (n,)."""
        rows = self._pieces_at(time_s)
        return np.asarray(time_s < rows[:, 0] + rows[:, 4], dtype=np.bool_)

    def at_mm(self, time_s: Floats | float) -> Floats:
        """Positions at the given times, shape (n,) (mm)."""
        rows = self._pieces_at(time_s)
        begin_s = np.where(np.isfinite(rows[..., 0]), rows[..., 0], time_s)
        since_s = np.minimum(time_s - begin_s, rows[..., 4])
        return np.asarray(rows[..., 1] + rows[..., 2] * since_s + 0.5 * rows[..., 3] * since_s**2, dtype=np.float64)

    def _until(self, time_s: float) -> list[Piece]:
        """Pieces that have begun until a time."""
        return [piece for piece in self._pieces if piece[0] <= time_s]

    def _replace(self, pieces: list[Piece]) -> None:
        self._pieces = tuple(pieces)
        self.version += 1

    def _pieces_at(self, time_s: Floats | float) -> Floats:
        pieces = np.array(self._pieces)
        return np.asarray(pieces[np.searchsorted(pieces[:, 0], time_s, side="right") - 1])

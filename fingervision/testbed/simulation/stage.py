"""Motion of a stage, composed of pieces of constant acceleration."""

from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Piece = tuple[float, float, float, float, float]
"""A piece of the motion: start time, position and speed at the start, acceleration, duration."""

# With 16 m/s2, the published stage moves by its 10 mm within 50 ms, with a triangular speed profile up to 400 mm/s (v =
# 2 s / T, a = 4 s / T^2).
ACCELERATION_MM_S2 = 16000.0
# Lead errors of a stage depend on its position: sinusoids with these periods, and these shares of the accuracy.
LEAD_PERIODS_MM, LEAD_SHARES = (7.3, 2.9, 1.1), (0.55, 0.3, 0.15)


class SimulatedStage:
    """True position of the simulated stage, for all past times and for the planned motion.

    Parameters
    ----------
    lower_mm, upper_mm : float
        Positions of the end stops.
    accuracy_mm : float
        Largest distance between a target and the position at which the stage stops, which is always the same for a
        target.
    rng : numpy.random.Generator
        Generator of the lead errors.
    """

    def __init__(self, lower_mm: float, upper_mm: float, accuracy_mm: float, rng: np.random.Generator) -> None:
        self.lower_mm, self.upper_mm = lower_mm, upper_mm
        self._accuracy_mm = accuracy_mm
        self._phases = rng.uniform(0.0, 2.0 * np.pi, len(LEAD_PERIODS_MM))
        # This tuple is always replaced as a whole, because another thread may stop the stage while this thread reads
        # the position.
        self._pieces: tuple[Piece, ...] = ((-np.inf, 0.0, 0.0, 0.0, 0.0),)
        self.homed_s: list[float] = []
        self.version = 0

    @property
    def planned_until_s(self) -> float:
        """End of the present motion (s); minus infinity before the first motion."""
        begin_s, _, _, _, duration_s = self._pieces[-1]
        return begin_s + duration_s

    @property
    def began_s(self) -> float:
        """Time of the first motion (s); infinity before the first motion."""
        return self._pieces[1][0] if len(self._pieces) > 1 else float("inf")

    def lands_at_mm(self, target_mm: float) -> float:
        """Position at which the stage stops when it is sent to a target (mm)."""
        waves = sum(
            share * np.sin(2.0 * np.pi * target_mm / period_mm + phase)
            for period_mm, share, phase in zip(LEAD_PERIODS_MM, LEAD_SHARES, self._phases, strict=True)
        )
        at_zero = sum(share * np.sin(phase) for share, phase in zip(LEAD_SHARES, self._phases, strict=True))
        # The reference defines position 0, which therefore has no error.
        landed_mm = target_mm + 0.5 * self._accuracy_mm * float(waves - at_zero)
        return min(max(landed_mm, self.lower_mm), self.upper_mm)

    def go(self, now_s: float, target_mm: float, speed_mm_s: float) -> None:
        """Begin a motion; a motion in progress is ended first."""
        self.halt(now_s)
        begin_s = max(now_s, self.planned_until_s)
        from_mm = float(self.at_mm(np.array([begin_s]))[0])
        way_mm = self.lands_at_mm(target_mm) - from_mm
        if way_mm == 0.0:
            return
        a = ACCELERATION_MM_S2
        top_mm_s = min(speed_mm_s, sqrt(abs(way_mm) * a))
        ramp_s = top_mm_s / a
        cruise_s = max(abs(way_mm) / top_mm_s - ramp_s, 0.0)
        v, a = copysign(top_mm_s, way_mm), copysign(a, way_mm)
        pieces = list(self._pieces)
        for speed, acceleration, duration_s in ((0.0, a, ramp_s), (v, 0.0, cruise_s), (v, -a, ramp_s)):
            pieces.append((begin_s, from_mm, speed, acceleration, duration_s))
            from_mm += speed * duration_s + 0.5 * acceleration * duration_s**2
            begin_s += duration_s
        self._pieces = tuple(pieces)
        self.version += 1

    def halt(self, now_s: float) -> None:
        """End the present motion as fast as the stage can."""
        if now_s >= self.planned_until_s:
            return
        begun = [piece for piece in self._pieces if piece[0] <= now_s]
        begin_s, from_mm, speed, acceleration, _ = begun[-1]
        since_s = now_s - begin_s
        at_mm = from_mm + speed * since_s + 0.5 * acceleration * since_s**2
        speed += acceleration * since_s
        braking_s = abs(speed) / ACCELERATION_MM_S2
        self._pieces = (
            *begun[:-1],
            (begin_s, from_mm, begun[-1][2], acceleration, since_s),
            (now_s, at_mm, speed, -copysign(ACCELERATION_MM_S2, speed), braking_s),
        )
        self.version += 1

    def home(self, now_s: float, speed_mm_s: float) -> None:
        """Move to the reference; a new run begins there, with the correct zero."""
        self.go(now_s, 0.0, speed_mm_s)
        self.homed_s.append(max(now_s, self.planned_until_s))
        self.version += 1

    def turns_s(self, after_s: float, until_s: float) -> list[float]:
        """Times at which a motion began or ended (s)."""
        ends = [(begin_s, begin_s + duration_s) for begin_s, _, _, _, duration_s in self._pieces[1:]]
        joined = {begin_s for begin_s, _ in ends} & {end_s for _, end_s in ends}
        return sorted({at for piece in ends for at in piece if at not in joined and after_s < at <= until_s})

    def moves(self, time_s: Array) -> NDArray[np.bool_]:
        """Whether the stage moves at the given times of the test bed, shape (n,)."""
        rows = self._pieces_at(time_s)
        return np.asarray(time_s < rows[:, 0] + rows[:, 4], dtype=np.bool_)

    def at_mm(self, time_s: Array) -> Array:
        """True positions at the given times of the test bed, shape (n,) (mm)."""
        rows = self._pieces_at(time_s)
        rows[:, 0] = np.where(np.isfinite(rows[:, 0]), rows[:, 0], time_s)
        since_s = np.minimum(time_s - rows[:, 0], rows[:, 4])
        return np.asarray(rows[:, 1] + rows[:, 2] * since_s + 0.5 * rows[:, 3] * since_s**2, dtype=np.float64)

    def _pieces_at(self, time_s: Array) -> Array:
        pieces = np.array(self._pieces)
        return np.asarray(pieces[np.searchsorted(pieces[:, 0], time_s, side="right") - 1])

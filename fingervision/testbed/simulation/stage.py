"""Motion of a stage, composed of pieces of constant acceleration."""

from math import inf

import numpy as np

from fingervision.domain.step_data import SpeedEntry
from fingervision.testbed.motion.motion_profile import MotionPath, profile

# With 16 m/s2, the published stage moves by its 10 mm within 50 ms, with a triangular speed profile up to 400 mm/s (v =
# 2 s / T, a = 4 s / T^2).
ACCELERATION_MM_S2 = 16000.0
# Lead errors of a stage depend on its position: sinusoids with these periods, and these shares of the accuracy.
LEAD_PERIODS_MM, LEAD_SHARES = (7.3, 2.9, 1.1), (0.55, 0.3, 0.15)


class SimulatedStage(MotionPath):
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
        super().__init__(0.0)
        self.lower_mm, self.upper_mm = lower_mm, upper_mm
        self._accuracy_mm = accuracy_mm
        self._phases = rng.uniform(0.0, 2.0 * np.pi, len(LEAD_PERIODS_MM))
        self.homed_s: list[float] = []

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
        way_mm = self.lands_at_mm(target_mm) - float(self.at_mm(begin_s))
        if way_mm != 0.0:
            ramps = SpeedEntry(speed_mm_s, ACCELERATION_MM_S2, ACCELERATION_MM_S2)
            self.begin(begin_s, profile(way_mm, ramps, inf))

    def halt(self, now_s: float) -> None:
        """End the present motion as fast as the stage can."""
        self.break_off(now_s, ACCELERATION_MM_S2)

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

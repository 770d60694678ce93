"""A real actuator whose readings drive a simulated gripper (hardware in the loop)."""

import numpy as np
from numpy.typing import NDArray

from fingervision.testbed.actuator import Actuator, Alarm, StageLimits
from fingervision.testbed.reading import Reading
from fingervision.testbed.simulation.gripper import Motion

Array = NDArray[np.float64]


class Followed:
    """An actuator that stores its readings, by which a simulated gripper is driven.

    Parameters
    ----------
    actuator : Actuator
        The real actuator.
    """

    def __init__(self, actuator: Actuator) -> None:
        self._actuator = actuator
        self._time_s: list[float] = []
        self._position_mm: list[float] = []
        self._homed_s: list[float] = []
        self._homing = False

    @property
    def name(self) -> str:
        """Name of the actuator."""
        return self._actuator.name

    @property
    def limits(self) -> StageLimits:
        """Limits of the actuator."""
        return self._actuator.limits

    @property
    def busy(self) -> bool:
        """Whether the actuator moves."""
        return self._actuator.busy

    @property
    def alarm(self) -> Alarm | None:
        """Reason why the actuator refuses to move."""
        return self._actuator.alarm

    @property
    def has_steps(self) -> bool:
        """Whether `run_step` is possible."""
        return self._actuator.has_steps

    @property
    def motion(self) -> Motion:
        """Motion of the stage as far as it was read from the actuator."""
        return Motion(
            self._at_mm, self._known_until_s, lambda: len(self._time_s), lambda: list(self._homed_s), self._began_s
        )

    def home(self) -> None:
        """Go to the reference."""
        self._actuator.home()
        self._homing = True

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Refuse a motion that the actuator cannot make."""
        self._actuator.check(from_mm, to_mm, speed_mm_s)

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position at a positive speed."""
        self._actuator.move(to_mm, speed_mm_s)

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move until stopped."""
        self._actuator.jog(speed_mm_s)

    def run_step(self, number: int) -> None:
        """Begin the motion of a step data block."""
        self._actuator.run_step(number)

    def stop(self) -> None:
        """Stop the motion at once."""
        self._actuator.stop()

    def close(self) -> None:
        """Stop and release the hardware."""
        self._actuator.close()

    def readings(self) -> tuple[Reading, ...]:
        """Positions since the last call, which are also stored."""
        readings = self._actuator.readings()
        newest = readings[-1]
        for reading in readings:
            # The age of streamed values relative to the newest value follows from the board's own clock.
            at_s = 0.5 * (newest.asked_s + newest.got_s) - (newest.device_s - reading.device_s)
            if not self._time_s or at_s > self._time_s[-1]:
                self._time_s.append(at_s)
                self._position_mm.append(reading.value)
        if self._homing and not self._actuator.busy:
            self._homing = False
            self._homed_s.append(self._time_s[-1])
        return readings

    def _at_mm(self, time_s: Array) -> Array:
        if not self._time_s:
            return np.zeros_like(time_s)
        return np.interp(time_s, self._time_s, self._position_mm)

    def _began_s(self) -> float:
        moved = (at_s for at_s, mm in zip(self._time_s, self._position_mm, strict=True) if mm != self._position_mm[0])
        return next(moved, float("inf"))

    def _known_until_s(self) -> float:
        return self._time_s[-1] if self._time_s else 0.0

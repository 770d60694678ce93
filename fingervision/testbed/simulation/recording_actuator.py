"""A real actuator whose readings drive a simulated gripper (hardware in the loop)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.testbed.actuator import Actuator
from fingervision.testbed.force_sensor import Reading
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

    def __getattr__(self, name: str) -> Any:
        """Every other member is that of the actuator."""
        return getattr(self._actuator, name)

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

"""A stage of Standa behind an 8SMC4 or 8SMC5 controller, by the maker's library libximc; needs the extra `standa`.

`device` is the library's address (`xi-com:///dev/ttyACM0`, `xi-tcp://192.168.1.5:1820`), and `step_mm` the travel of
a full step, from the stage's data sheet. Tested with the virtual controller that the library brings (`xi-emu:///FILE`),
not on hardware.
"""

import threading
from typing import Any

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError, in_a_line
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import (
    AxisSettings,
    SingleAxis,
    stated_axis,
    without_hardware,
)
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock

__all__ = ["KEYS", "SIMULATED", "StandaStage", "build", "without_hardware"]
KEYS = ("device", "step_mm", "acceleration_mm_s2", "homes", *AXIS)
SIMULATED = False
# Flags of the status (libximc, "Status": MvCmdSts and Flags).
ERROR, RUNNING, ALARM, HOMED = 0x40, 0x80, 0x40, 0x20


class StandaStage(SingleAxis):
    """One axis.

    Parameters
    ----------
    axis : libximc.highlevel.Axis
        The open axis, calibrated in millimetres.
    acceleration_mm_s2 : float or None
        Acceleration and deceleration; by default those that the controller has.
    homes : bool
        Whether the stage can search its reference.
    name, clock, settings
        As in `SingleAxis`.
    """

    def __init__(
        self, axis: Any, acceleration_mm_s2: float | None, name: str, clock: Clock, settings: AxisSettings, *,
        homes: bool,
    ) -> None:  # fmt: skip
        super().__init__(f"Standa controller {axis.get_serial_number()} at {name}", clock, settings)
        self._axis, self._acceleration, self._homes = axis, acceleration_mm_s2, homes
        self._device = threading.Lock()  # keeps the messages of two threads apart

    def _status(self) -> Any:
        with self._device:
            return self._axis.get_status_calb()

    def _moving(self) -> bool:
        status = self._status()
        if int(status.MvCmdSts) & ERROR or int(status.Flags) & ALARM:
            raise RefusedError("alarm", "an alarm or a failed motion: see XiLab, and clear it there")
        self._homed = not self._homes or bool(int(status.Flags) & HOMED)
        return bool(int(status.MvCmdSts) & RUNNING)

    def _position_mm(self) -> float:
        return float(self._status().CurPosition)

    def _go_home(self) -> None:
        if self._homes:
            with self._device:
                self._axis.command_home()

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        with self._device:
            motion = self._axis.get_move_settings_calb()
            motion.Speed = speed_mm_s
            if self._acceleration is not None:
                motion.Accel = motion.Decel = self._acceleration
            self._axis.set_move_settings_calb(motion)
            self._axis.command_move_calb(to_mm)

    def _halt(self) -> None:
        with self._device:
            self._axis.command_stop()

    def _release(self) -> None:
        self._axis.close_device()


def build(section: Section, context: BuildContext) -> StandaStage:
    """Open the controller that the configuration states."""
    try:
        from libximc.highlevel import Axis
    except (ImportError, RuntimeError, OSError) as error:  # the library cannot be loaded on every system
        section.refuse("kind", f"needs libximc, which cannot be used ({error}): pip install 'fingervision[standa]'.")
    settings, name = stated_axis(section), section.word("device")
    step_mm, homes = section.number("step_mm", above=0.0), section.flag("homes")
    ramp = section.number("acceleration_mm_s2", above=0.0) if "acceleration_mm_s2" in section.values else None
    axis = Axis(name)
    try:
        axis.open_device()
        axis.set_calb(step_mm, axis.get_engine_settings().MicrostepMode)
    except Exception as error:  # the library raises exceptions of several classes
        section.refuse("device", f"must be that of a controller, but {name} could not be opened ({in_a_line(error)}).")
    return StandaStage(axis, ramp, name, context.clock, settings, homes=homes).at_rest()

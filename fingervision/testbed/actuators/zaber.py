"""A Zaber stage (X-, A-Series and others with Zaber's ASCII protocol) by zaber-motion; needs the extra `zaber`.

`port` is a serial port, or HOST:PORT of a controller in the network. `microstep_mm` is the stage's microstep size from
its data sheet. Positions are sent and read in microsteps, speeds in microsteps/s x 1.6384 (Zaber, "ASCII Protocol
Manual", units), so that neither a device database nor a network is needed. The adapter is tested with zaber-motion
against an emulated device in the network, written from the manual (tests/adapters/zaber_device.py), and not on
hardware. The library's own mock connection cannot be used, because it does not respond to commands.
"""

from collections.abc import Callable
from typing import Any

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import (
    AxisSettings,
    SingleAxis,
    T,
    in_a_line,
    stated_axis,
    without_hardware,
)
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock

__all__ = ["KEYS", "SIMULATED", "ZaberStage", "build", "without_hardware"]
KEYS = ("port", "device", "axis", "microstep_mm", *AXIS)
SIMULATED = False
SPEED_UNIT = 1.6384
"""Value of one microstep per second in native speed units (Zaber, "ASCII Protocol Manual", maxspeed)."""


class ZaberStage(SingleAxis):
    """One axis of a Zaber device.

    Parameters
    ----------
    connection : zaber_motion.ascii.Connection
        The open connection.
    axis : zaber_motion.ascii.Axis
        The axis of the stage.
    microstep_mm : float
        Distance of one microstep.
    clock : Clock
        Clock of the test bed.
    settings : AxisSettings
        Limits and coordinate of the stage.

    Raises
    ------
    DeviceError
        The device does not answer.
    """

    def __init__(self, connection: Any, axis: Any, microstep_mm: float, clock: Clock, settings: AxisSettings) -> None:
        name = f"Zaber device {axis.device.device_address}, axis {axis.axis_number}"
        super().__init__(name, clock, settings)
        self._connection, self._axis, self._microstep_mm = connection, axis, microstep_mm
        # The device stores its highest speed permanently: the previous value is restored at the end.
        self._speed_before = self._asked(lambda: axis.settings.get("maxspeed"))

    def _moving(self) -> bool:
        return bool(self._axis.is_busy())

    def _position_mm(self) -> float:
        return float(self._axis.get_position()) * self._microstep_mm

    def _go_home(self) -> None:
        self._axis.home(wait_until_idle=False)

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        self._axis.settings.set("maxspeed", max(1, round(speed_mm_s / self._microstep_mm * SPEED_UNIT)))
        self._axis.move_absolute(round(to_mm / self._microstep_mm), wait_until_idle=False)

    def _halt(self) -> None:
        self._axis.stop(wait_until_idle=False)

    def _release(self) -> None:
        try:
            self._axis.stop()
            self._axis.settings.set("maxspeed", self._speed_before)
        finally:
            self._connection.close()

    def _asked(self, act: Callable[[], T]) -> T:
        from zaber_motion.exceptions import CommandFailedException

        def asked() -> T:
            try:
                return act()
            except CommandFailedException as error:
                code = str(getattr(error.details, "response_data", error))
                raise RefusedError(code, f"the device answered {code}") from error

        return super()._asked(asked)


def build(section: Section, context: BuildContext) -> ZaberStage:
    """Connect to the device that the configuration states."""
    try:
        from zaber_motion.ascii import Connection
    except ImportError as error:
        section.refuse(
            "kind", f"needs zaber-motion, which is not installed ({error}): pip install 'fingervision[zaber]'."
        )
    settings, port = stated_axis(section), section.word("port")
    device, axis = section.whole("device", 1, low=1, high=99), section.whole("axis", 1, low=1, high=9)
    microstep_mm = section.number("microstep_mm", above=0.0)
    try:
        host, _, number = port.rpartition(":")
        connection = (
            Connection.open_tcp(host, int(number)) if host and number.isdigit() else Connection.open_serial_port(port)
        )
    except Exception as error:
        words = f"must be that of a Zaber device, but {port} could not be opened ({in_a_line(error)})."
        section.refuse("port", words)
    its = connection.get_device(device).get_axis(axis)
    return ZaberStage(connection, its, microstep_mm, context.clock, settings).at_rest()

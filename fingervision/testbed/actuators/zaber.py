"""A Zaber stage (X-, A-Series and others with Zaber's ASCII protocol) by zaber-motion; needs the extra `zaber`.

`port` is a serial port, or HOST:PORT of a controller in the network. `microstep_mm` is the stage's microstep size from
its data sheet. Positions are sent and read in microsteps, speeds in microsteps/s x 1.6384 (Zaber, "ASCII Protocol
Manual", units), so that neither a device database nor a network is needed. Tested with zaber-motion against an emulated
device in the network, written from the manual (tests/adapters/ zaber_device.py); not on hardware. The library's own
mock connection cannot be used, because it answers no commands.
"""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from fingervision.domain.errors import DeviceError, FingervisionError, LimitError, StateError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, StageLimits
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.move_limits import FreeMoves, check_move, check_speed
from fingervision.testbed.motion.stated_limits import KEYS as LIMITS
from fingervision.testbed.motion.stated_limits import stated_limits
from fingervision.testbed.reading import Reading

KEYS = ("port", "device", "axis", "microstep_mm", *LIMITS)
SIMULATED = False
SPEED_UNIT = 1.6384
"""Native speed of one microstep per second (Zaber, "ASCII Protocol Manual", maxspeed)."""
T = TypeVar("T")


class ZaberStage:
    """One axis of a device.

    Parameters
    ----------
    connection : zaber_motion.ascii.Connection
        Open.
    axis : zaber_motion.ascii.Axis
        Of the stage.
    microstep_mm : float
        Way of one microstep.
    clock : Clock
        The bed's.
    limits : StageLimits
        What it can do.

    Raises
    ------
    DeviceError
        The device does not answer.
    """

    has_steps = False

    def __init__(self, connection: Any, axis: Any, microstep_mm: float, clock: Clock, limits: StageLimits) -> None:
        self.name = f"Zaber device {axis.device.device_address}, axis {axis.axis_number}"
        self.limits = limits
        self._connection, self._axis, self._microstep_mm, self._clock = connection, axis, microstep_mm, clock
        self._line = threading.RLock()  # a question and its answer belong together, also when another thread stops
        self._alarm: Alarm | None = None
        self._closed = False
        # The device keeps its highest speed when it is switched off: it gets back the one that it had.
        self._speed_before = self._asked(lambda: axis.settings.get("maxspeed"))

    @property
    def busy(self) -> bool:
        """Whether it moves."""
        return bool(self._asked(self._axis.is_busy))

    @property
    def alarm(self) -> Alarm | None:
        """The device's last refusal, such as a stall or an unknown reference."""
        return self._alarm

    def home(self) -> None:
        """Go to the reference and define it as position 0."""
        self._ready()
        self._do(lambda: self._axis.home(wait_until_idle=False))

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Refuse motions beyond the limits."""
        check_move(self.limits, to_mm, speed_mm_s)

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move."""
        check_move(self.limits, to_mm, speed_mm_s)
        self._ready()

        def begin() -> None:
            self._axis.settings.set("maxspeed", max(1, round(speed_mm_s / self._microstep_mm * SPEED_UNIT)))
            self._axis.move_absolute(round(to_mm / self._microstep_mm), wait_until_idle=False)

        self._do(begin)

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move until stopped or at a limit."""
        check_speed(self.limits, abs(speed_mm_s))
        if speed_mm_s != 0.0:
            # The device's own endless motion knows its own limits alone, not those of the bed's configuration.
            self.move(self.limits.upper_mm if speed_mm_s > 0.0 else self.limits.lower_mm, abs(speed_mm_s))

    def run_step(self, number: int) -> None:
        """Refuse: this device has no step data that a bed could use."""
        raise LimitError(f"Step {number} must be kept by the controller, but a Zaber stage has none: use move.")

    def stop(self) -> None:
        """Stop at once."""
        with self._line:
            self._axis.stop(wait_until_idle=False)

    def readings(self) -> tuple[Reading, ...]:
        """The present position only, because the device stores no earlier ones."""
        with self._line:
            asked_s = self._clock.now_s()
            position_mm = float(self._asked(self._axis.get_position)) * self._microstep_mm
            got_s = self._clock.now_s()
            moving = self.busy
        return (Reading(0.5 * (asked_s + got_s), asked_s, got_s, position_mm, moving),)

    def close(self) -> None:
        """Stop, restore the maximum speed, and close the port."""
        if self._closed:
            return
        self._closed = True
        with self._line:
            try:
                self._axis.stop()
                self._axis.settings.set("maxspeed", self._speed_before)
            finally:
                self._connection.close()

    def _ready(self) -> None:
        if self.busy:
            raise StateError("The stage must stand before it moves again, but is busy: stop it first.")

    def _do(self, act: Callable[[], None]) -> None:
        """Send a command; a refusal by the device becomes its alarm."""
        from zaber_motion.exceptions import CommandFailedException

        try:
            with self._line:
                act()
        except CommandFailedException as error:
            words = str(getattr(error.details, "response_data", error))
            self._alarm = Alarm(words, f"the device answered {words}")
            raise DeviceError(f"{self.name} must take the command, but refused it ({words}): home it first.") from error
        except Exception as error:
            raise self._silent(error) from error
        self._alarm = None

    def _asked(self, act: Callable[[], T]) -> T:
        try:
            with self._line:
                return act()
        except FingervisionError:
            raise
        except Exception as error:  # the library has a class for each thing that may fail
            raise self._silent(error) from error

    def _silent(self, error: Exception) -> DeviceError:
        said = f"{type(error).__name__}: {error}".replace("\n", " ")[:200].rstrip(".")
        return DeviceError(f"{self.name} must answer, but did not ({said}): check its cable.")


def without_hardware(section: Section, folder: Path) -> FreeMoves:
    """Limits of the stage, for checking a plan without the bed."""
    return FreeMoves(stated_limits(section))


def build(section: Section, context: BuildContext) -> ZaberStage:
    """Connect as the section of the configuration states."""
    try:
        from zaber_motion.ascii import Connection
    except ImportError as error:
        section.refuse("kind", f"needs zaber-motion, which is not here ({error}): pip install 'fingervision[zaber]'.")
    limits, port = stated_limits(section), section.word("port")
    device, axis = section.whole("device", 1, low=1, high=99), section.whole("axis", 1, low=1, high=9)
    microstep_mm = section.number("microstep_mm", above=0.0)
    try:
        host, _, number = port.rpartition(":")
        connection = (
            Connection.open_tcp(host, int(number)) if host and number.isdigit() else Connection.open_serial_port(port)
        )
    except Exception as error:
        said = f"{type(error).__name__}: {error}".replace("\n", " ")[:200].rstrip(".")
        section.refuse("port", f"must be that of a Zaber device, but {port} could not be opened ({said}).")
    return ZaberStage(connection, connection.get_device(device).get_axis(axis), microstep_mm, context.clock, limits)

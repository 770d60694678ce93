"""Base class of stages that are driven through a library of their maker or community; they store no step data."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from fingervision.domain.errors import DeviceError, FingervisionError, LimitError, StateError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, StageLimits
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.move_limits import FreeMoves, check_move, check_speed
from fingervision.testbed.motion.stated_limits import stated_limits
from fingervision.testbed.reading import Reading

T = TypeVar("T")


class LibraryAxis(ABC):
    """An actuator (`testbed.actuator`) that uses six calls of a library, each of which may raise any exception.

    Parameters
    ----------
    name : str
        Name of the actuator in run.json and in errors.
    device : str
        Description with an article: `a Zaber stage`.
    clock : Clock
        Clock of the test bed.
    limits : StageLimits
        Limits of the stage.
    """

    has_steps = False

    def __init__(self, name: str, device: str, clock: Clock, limits: StageLimits) -> None:
        self.name, self.limits = name, limits
        self._device, self._clock = device, clock
        self._line = threading.RLock()  # keeps each question together with its answer if another thread sends a stop
        self._alarm: Alarm | None = None
        self._closed = False

    @abstractmethod
    def _moving(self) -> bool:
        """Query the device whether a motion is in progress."""

    @abstractmethod
    def _position_mm(self) -> float:
        """Query the device for its position (mm)."""

    @abstractmethod
    def _go_home(self) -> None:
        """Begin to move to the reference."""

    @abstractmethod
    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position."""

    @abstractmethod
    def _halt(self) -> None:
        """Stop the motion."""

    @abstractmethod
    def _release(self) -> None:
        """Stop and close the port."""

    @abstractmethod
    def _do(self, act: Callable[[], None]) -> None:
        """Send a command; a refusal by the device is stored as the alarm and raised as a DeviceError."""

    @property
    def busy(self) -> bool:
        """Whether the actuator moves."""
        return bool(self._asked(self._moving))

    @property
    def alarm(self) -> Alarm | None:
        """The device's last refusal, such as a stall or an unknown reference position."""
        return self._alarm

    def home(self) -> None:
        """Go to the reference and define it as position 0."""
        self._ready()
        self._do(self._go_home)

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Refuse motions beyond the limits of the stage."""
        check_move(self.limits, to_mm, speed_mm_s)

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position at a positive speed."""
        check_move(self.limits, to_mm, speed_mm_s)
        self._ready()
        self._do(lambda: self._begin(to_mm, speed_mm_s))

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move until stopped or until a limit is reached."""
        check_speed(self.limits, abs(speed_mm_s))
        if speed_mm_s != 0.0:
            # The device's own continuous motion would ignore the limits in the test bed's configuration.
            self.move(self.limits.upper_mm if speed_mm_s > 0.0 else self.limits.lower_mm, abs(speed_mm_s))

    def run_step(self, number: int) -> None:
        """Refuse: a stage that is driven through a library has no step data that a test bed could use."""
        raise LimitError(f"Step {number} must be stored in the controller, but {self._device} has none: use move.")

    def stop(self) -> None:
        """Stop the motion at once."""
        with self._line:
            self._halt()

    def readings(self) -> tuple[Reading, ...]:
        """The present position only, because the device does not store earlier positions."""
        with self._line:
            asked_s = self._clock.now_s()
            position_mm = self._asked(self._position_mm)
            got_s = self._clock.now_s()
            moving = self.busy
        return (Reading(0.5 * (asked_s + got_s), asked_s, got_s, position_mm, moving),)

    def close(self) -> None:
        """Stop and close the port."""
        if self._closed:
            return
        self._closed = True
        with self._line:
            self._release()

    def _ready(self) -> None:
        if self.busy:
            raise StateError("The stage must be at rest before a new motion, but is still moving: stop it first.")

    def _asked(self, act: Callable[[], T]) -> T:
        try:
            with self._line:
                return act()
        except FingervisionError:
            raise
        except Exception as error:  # serial ports, VISA and each library raise exceptions of their own classes
            raise self._silent(error) from error

    def _silent(self, error: Exception) -> DeviceError:
        return DeviceError(f"{self.name} must answer a request, but did not ({in_a_line(error)}): check its cable.")


def in_a_line(error: Exception) -> str:
    """An exception's class and message, in one line without a full stop."""
    return f"{type(error).__name__}: {error}".replace("\n", " ")[:200].rstrip(".")


def without_hardware(section: Section, folder: Path) -> FreeMoves:
    """Limits of the stage, for checking a plan without opening the test bed."""
    return FreeMoves(stated_limits(section))

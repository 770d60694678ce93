"""A Newport ESP300 (or ESP301) motion controller's axis as a stage, by pymeasure; needs the extra `pymeasure`.

Commands as in Newport's "ESP300 User's Manual" (PA, VA, MV, ST, OR, MD, TP, TE), which pymeasure's `ESP300` speaks.
Tested against pymeasure's own protocol emulator (`pymeasure.test.expected_protocol`, each command to the letter) and
against an emulated axis written from the manual (tests/adapters/esp300_axis.py); not on hardware.
"""

import threading
import warnings
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

KEYS = ("port", "axis", *LIMITS)
SIMULATED = False
MILLIMETRE = "millimeter"
"""As pymeasure calls the unit that the axis must be set to (SN2)."""
T = TypeVar("T")


class Esp300Stage:
    """One axis of the controller.

    Parameters
    ----------
    controller : pymeasure.instruments.newport.ESP300
        Connected.
    axis : pymeasure.instruments.newport.esp300.Axis
        Of the stage.
    clock : Clock
        The bed's.
    limits : StageLimits
        What it can do.

    Raises
    ------
    FingervisionError
        The controller does not answer, or the axis does not count in millimetres.
    """

    has_steps = False

    def __init__(self, controller: Any, axis: Any, clock: Clock, limits: StageLimits) -> None:
        self.name = f"Newport ESP300, axis {axis.axis}"
        self.limits = limits
        self._controller, self._axis, self._clock = controller, axis, clock
        self._line = threading.RLock()  # a question and its answer belong together, also when another thread stops
        self._alarm: Alarm | None = None
        self._closed = False
        units = self._asked(lambda: axis.units)
        if units != MILLIMETRE:
            raise DeviceError(
                f"{self.name} must count in {MILLIMETRE}s, but counts in {units}: set it (1SN2) and home it."
            )
        self._do(axis.enable)

    @property
    def busy(self) -> bool:
        """Whether it moves."""
        return not self._asked(lambda: self._axis.motion_done)

    @property
    def alarm(self) -> Alarm | None:
        """The controller's last error that keeps the axis from moving."""
        return self._alarm

    def home(self) -> None:
        """Go to the reference and define it as position 0."""
        self._ready()
        self._do(lambda: self._axis.home(1))

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Refuse motions beyond the limits."""
        check_move(self.limits, to_mm, speed_mm_s)

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move."""
        check_move(self.limits, to_mm, speed_mm_s)
        self._ready()

        def begin() -> None:
            self._axis.write(f"VA{speed_mm_s:.6g}")
            self._axis.position = to_mm

        self._do(begin)

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move until stopped or at a limit."""
        check_speed(self.limits, abs(speed_mm_s))
        if speed_mm_s != 0.0:
            # The controller's own jog (MV) knows its own limits alone, not those of the bed's configuration.
            self.move(self.limits.upper_mm if speed_mm_s > 0.0 else self.limits.lower_mm, abs(speed_mm_s))

    def run_step(self, number: int) -> None:
        """Refuse: this controller stores programs, not step data."""
        raise LimitError(f"Step {number} must be kept by the controller, but an ESP300 has none: use move.")

    def stop(self) -> None:
        """Stop at once."""
        with self._line:
            self._axis.write("ST")

    def readings(self) -> tuple[Reading, ...]:
        """The present position only, because the controller stores no earlier ones."""
        with self._line:
            asked_s = self._clock.now_s()
            position_mm = float(self._asked(lambda: self._axis.position))
            got_s = self._clock.now_s()
            moving = not self._asked(lambda: self._axis.motion_done)
        return (Reading(0.5 * (asked_s + got_s), asked_s, got_s, position_mm, moving),)

    def close(self) -> None:
        """Stop and close the port."""
        if self._closed:
            return
        self._closed = True
        with self._line:
            self._axis.write("ST")
            self._controller.adapter.close()

    def _ready(self) -> None:
        if self.busy:
            raise StateError("The stage must stand before it moves again, but is busy: stop it first.")

    def _do(self, act: Callable[[], None]) -> None:
        """Send a command, and ask whether the controller accepted it."""
        with self._line:
            self._asked(act)
            errors = self._asked(lambda: self._controller.errors)
        if errors:
            words = "; ".join(str(getattr(one, "message", one)).lower() for one in errors)
            self._alarm = Alarm(str(getattr(errors[0], "error", "")), words)
            raise DeviceError(f"{self.name} must take the command, but refused it ({words}): nothing was moved.")
        self._alarm = None

    def _asked(self, act: Callable[[], T]) -> T:
        try:
            with self._line:
                return act()
        except FingervisionError:
            raise
        except Exception as error:  # serial lines, VISA and pymeasure each have classes of their own
            said = f"{type(error).__name__}: {error}".replace("\n", " ")[:200].rstrip(".")
            raise DeviceError(f"{self.name} must answer, but did not ({said}): check its cable.") from error


def without_hardware(section: Section, folder: Path) -> FreeMoves:
    """Limits of the stage, for checking a plan without the bed."""
    return FreeMoves(stated_limits(section))


def build(section: Section, context: BuildContext) -> Esp300Stage:
    """Connect as the section of the configuration states: `port` is a VISA resource such as ASRL/dev/ttyUSB0."""
    try:
        from pymeasure.instruments.newport import ESP300
        from pymeasure.instruments.newport.esp300 import Axis
    except ImportError as error:
        section.refuse("kind", f"needs pymeasure, which is not here ({error}): pip install 'fingervision[pymeasure]'.")
    limits, port, number = stated_limits(section), section.word("port"), section.whole("axis", 1, low=1, high=3)
    try:
        with warnings.catch_warnings():
            # pymeasure asks its own maintainers whether this controller knows SCPI; nothing of that is used here.
            warnings.simplefilter("ignore", FutureWarning)
            controller = ESP300(port)
    except Exception as error:  # every VISA library has classes of its own
        said = f"{type(error).__name__}: {error}".replace("\n", " ")[:200].rstrip(".")
        section.refuse("port", f"must be that of an ESP300, but {port} could not be opened ({said}).")
    return Esp300Stage(controller, Axis(number, controller), context.clock, limits)

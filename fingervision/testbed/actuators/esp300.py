"""A Newport ESP300 (or ESP301) motion controller's axis as a stage, by pymeasure; needs the extra `pymeasure`.

Commands as in Newport's "ESP300 User's Manual" (PA, VA, MV, ST, OR, MD, TP, TE), which pymeasure's `ESP300` uses. The
adapter is tested against pymeasure's protocol emulator (`pymeasure.test.expected_protocol`, which compares each
command) and against an emulated axis written from the manual (tests/adapters/esp300_axis.py), and not on hardware.
"""

import warnings
from collections.abc import Callable
from typing import Any

from fingervision.domain.errors import DeviceError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, StageLimits
from fingervision.testbed.actuators._library_axis import LibraryAxis, in_a_line, without_hardware
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.stated_limits import KEYS as LIMITS
from fingervision.testbed.motion.stated_limits import stated_limits

__all__ = ["KEYS", "SIMULATED", "Esp300Stage", "build", "without_hardware"]
KEYS = ("port", "axis", *LIMITS)
SIMULATED = False
MILLIMETRE = "millimeter"
"""Pymeasure's name of the unit to which the axis must be set (SN2)."""


class Esp300Stage(LibraryAxis):
    """One axis of an ESP300 controller.

    Parameters
    ----------
    controller : pymeasure.instruments.newport.ESP300
        The connected controller.
    axis : pymeasure.instruments.newport.esp300.Axis
        The axis of the stage.
    clock : Clock
        Clock of the test bed.
    limits : StageLimits
        Limits of the stage.

    Raises
    ------
    DeviceError
        The controller does not answer, or the axis does not count in millimetres.
    """

    def __init__(self, controller: Any, axis: Any, clock: Clock, limits: StageLimits) -> None:
        super().__init__(f"Newport ESP300, axis {axis.axis}", "an ESP300", clock, limits)
        self._controller, self._axis = controller, axis
        units = self._asked(lambda: axis.units)
        if units != MILLIMETRE:
            raise DeviceError(
                f"The unit of {self.name} must be {MILLIMETRE}, but is {units}: set it (1SN2) and home the stage."
            )
        self._do(axis.enable)

    def _moving(self) -> bool:
        return not self._axis.motion_done

    def _position_mm(self) -> float:
        return float(self._axis.position)

    def _go_home(self) -> None:
        self._axis.home(1)

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        self._axis.write(f"VA{speed_mm_s:.6g}")
        self._axis.position = to_mm

    def _halt(self) -> None:
        self._axis.write("ST")

    def _release(self) -> None:
        self._axis.write("ST")
        self._controller.adapter.close()

    def _do(self, act: Callable[[], None]) -> None:
        with self._line:
            self._asked(act)
            errors = self._asked(lambda: self._controller.errors)
        if errors:
            words = "; ".join(str(getattr(one, "message", one)).lower() for one in errors)
            self._alarm = Alarm(str(getattr(errors[0], "error", "")), words)
            raise DeviceError(f"{self.name} must accept the command, but refused it ({words}): nothing was moved.")
        self._alarm = None


def build(section: Section, context: BuildContext) -> Esp300Stage:
    """Connect to the controller that the configuration states: `port` is a VISA resource such as ASRL/dev/ttyUSB0."""
    try:
        from pymeasure.instruments.newport import ESP300
        from pymeasure.instruments.newport.esp300 import Axis
    except ImportError as error:
        section.refuse(
            "kind", f"needs pymeasure, which is not installed ({error}): pip install 'fingervision[pymeasure]'."
        )
    limits, port, number = stated_limits(section), section.word("port"), section.whole("axis", 1, low=1, high=3)
    try:
        with warnings.catch_warnings():
            # pymeasure warns that it is not known whether this controller supports SCPI; SCPI is not used here.
            warnings.simplefilter("ignore", FutureWarning)
            controller = ESP300(port)
    except Exception as error:  # each VISA library raises exceptions of its own classes
        words = f"must be that of an ESP300, but {port} could not be opened ({in_a_line(error)})."
        section.refuse("port", words)
    return Esp300Stage(controller, Axis(number, controller), context.clock, limits)

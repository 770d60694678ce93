"""A stage with a device adapter of Micro-Manager; needs the extra `micromanager` and an installation of Micro-Manager.

`configuration` is the file of Micro-Manager's hardware wizard, `folder` that of the adapters, `device` the stage's
label. Without `speed_property`, the stage is led along a ramp of positions. Tested with Micro-Manager's own demo stages
(mm-test-adapters), not on hardware.
"""

from typing import Any

from fingervision.storage.toml_section import Section
from fingervision.testbed import micromanager_core
from fingervision.testbed.actuator import RefusedError
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import AxisSettings, SetpointAxis, stated_axis, without_hardware
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.micromanager_core import Core, core_of

__all__ = ["KEYS", "SIMULATED", "MicroManagerStage", "build", "without_hardware"]
KEYS = (*micromanager_core.KEYS, "axis", "speed_property", "speed_per_mm_s", "homes", *AXIS)
SIMULATED = False
UM = 1000.0  # micrometres, in which Micro-Manager counts, in a millimetre


class MicroManagerStage(SetpointAxis):
    """One axis of a stage.

    Parameters
    ----------
    shared : Core
        The core.
    device, axis : str
        Label of the stage, and `x` or `y` for a stage of two axes; empty for one of one axis.
    speed : (str, float)
        Property of the speed (empty: none), and its units in a millimetre per second.
    homes : bool
        Whether the device can search its reference.
    clock, settings
        As in `SingleAxis`.
    """

    def __init__(
        self, shared: Core, device: str, axis: str, speed: tuple[str, float], clock: Clock, settings: AxisSettings,
        *, homes: bool,
    ) -> None:  # fmt: skip
        super().__init__(f"Micro-Manager stage {device}{axis}", clock, settings)
        self._shared, self._device, self._axis, self._speed, self._homes = shared, device, axis, speed, homes

    @property
    def _core(self) -> Any:
        return self._shared.core

    def _position_mm(self) -> float:
        read = {"x": self._core.getXPosition, "y": self._core.getYPosition, "": self._core.getPosition}[self._axis]
        return float(read(self._device)) / UM

    def _takes_speed(self, speed_mm_s: float) -> bool:
        name, per_mm_s = self._speed
        if name:
            self._core.setProperty(self._device, name, speed_mm_s * per_mm_s)
        return bool(name)

    def _put(self, to_mm: float) -> None:
        core, device, to_um = self._core, self._device, to_mm * UM
        try:
            if self._axis == "x":
                core.setXYPosition(device, to_um, core.getYPosition(device))
            elif self._axis == "y":
                core.setXYPosition(device, core.getXPosition(device), to_um)
            else:
                core.setPosition(device, to_um)
        except RuntimeError as error:
            self._ramp = None
            raise RefusedError("refused", " ".join(str(error).split())) from error

    def _settled(self) -> bool:
        return not self._core.deviceBusy(self._device)

    def _go_home(self) -> None:
        if self._homes:
            self._core.home(self._device)

    def _halt(self) -> None:
        self._ramp = None
        self._core.stop(self._device)

    def _release(self) -> None:
        self._shared.release()


def build(section: Section, context: BuildContext) -> MicroManagerStage:
    """Load the configuration, and find the stage in it."""
    settings, shared = stated_axis(section), core_of(section, context)
    device, axis = section.word("device"), section.word("axis", "", of=("", "x", "y"))
    name, homes = section.word("speed_property", ""), section.flag("homes")
    speed = name, section.number("speed_per_mm_s", UM, above=0.0)
    if name and not shared.core.hasProperty(device, name):
        known = ", ".join(shared.core.getDevicePropertyNames(device))
        section.refuse("speed_property", f"must be a property of {device} ({known}), but is {name!r}.")
    return MicroManagerStage(shared, device, axis, speed, context.clock, settings, homes=homes).at_rest()

"""Any device of ophyd or ophyd-async that can be set and read; needs the library that the device is from.

`device` is the import path of a class, a function or an object, such as `ophyd:EpicsMotor`; `arguments` and `named` are
given to it. Tested with ophyd's EpicsMotor and SoftPositioner and ophyd-async's SimMotor, not on hardware.
"""

import asyncio
import threading
from collections.abc import Callable
from importlib import import_module
from inspect import isawaitable, iscoroutinefunction
from typing import Any

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError, in_a_line
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import (
    AxisSettings,
    SetpointAxis,
    stated_axis,
    without_hardware,
)
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock

__all__ = ["KEYS", "SIMULATED", "OphydStage", "build", "without_hardware"]
KEYS = ("device", "arguments", "named", "speed", "home", "units_per_mm", *AXIS)
SIMULATED = False
CONNECTS_S, ANSWER_S = 10.0, 2.0


class _Caller:
    """Calls a device: directly, or in an event loop of its own thread if the device is asynchronous."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None

    def start(self) -> None:
        """Start the event loop."""
        self._loop = loop = asyncio.new_event_loop()

        def run() -> None:
            loop.run_forever()
            loop.close()

        threading.Thread(target=run, name="ophyd", daemon=True).start()

    def __call__(self, act: Callable[..., Any], *arguments: Any, within_s: float = ANSWER_S, **named: Any) -> Any:
        async def called() -> Any:
            answer = act(*arguments, **named)
            # A status is awaitable as well, but is wanted as it is, at once.
            return await answer if isawaitable(answer) and not hasattr(answer, "done") else answer

        if self._loop is None:
            return act(*arguments, **named)
        return asyncio.run_coroutine_threadsafe(called(), self._loop).result(within_s)

    def end(self) -> None:
        """End what the device still does, and the event loop."""

        async def ended() -> None:
            for task in asyncio.all_tasks() - {asyncio.current_task()}:
                task.cancel()

        if self._loop is not None:
            asyncio.run_coroutine_threadsafe(ended(), self._loop).result(ANSWER_S)
            self._loop.call_soon_threadsafe(self._loop.stop)


class OphydStage(SetpointAxis):
    """A device with `set` and `stop`, and `locate`, `position` or `read`.

    Parameters
    ----------
    device : object
        The device.
    call : callable
        Calls the device.
    speed, home : str
        Names of the device's signal for the speed, and of its method that searches the reference; may be empty.
    units_per_mm : float
        Units of the device in a millimetre.
    clock, settings
        As in `SingleAxis`.
    """

    def __init__(
        self, device: Any, call: _Caller, speed: str, home: str, units_per_mm: float, clock: Clock,
        settings: AxisSettings,
    ) -> None:  # fmt: skip
        super().__init__(f"ophyd device {device.name or type(device).__name__}", clock, settings)
        self._device, self._call, self._speed, self._home, self._per_mm = device, call, speed, home, units_per_mm
        self._status: Any = None

    def _position_mm(self) -> float:
        device = self._device
        if hasattr(device, "locate"):
            position = self._call(device.locate)["readback"]
        elif hasattr(device, "position"):
            position = device.position
        else:
            position = next(iter(self._call(device.read).values()))["value"]
        return float(position) / self._per_mm

    def _takes_speed(self, speed_mm_s: float) -> bool:
        if not self._speed:
            return False
        status = self._call(getattr(self._device, self._speed).set, speed_mm_s * self._per_mm)
        if hasattr(status, "wait"):
            status.wait(timeout=ANSWER_S)
        return True

    def _put(self, to_mm: float) -> None:
        def put() -> Any:
            status = self._device.set(to_mm * self._per_mm)
            status.add_callback(lambda done: done.exception())  # a stop makes the status fail, which is no error
            return status

        self._status = self._call(put)

    def _settled(self) -> bool:
        status = self._status
        if status is None:
            return not getattr(self._device, "moving", False)
        if not status.done:
            return False
        self._status = None
        if not status.success:
            error = status.exception()
            raise RefusedError("failed", f"that its motion failed ({in_a_line(error) if error else 'no reason given'})")
        return True

    def _go_home(self) -> None:
        if self._home:
            self._status = self._call(getattr(self._device, self._home))

    def _halt(self) -> None:
        self._ramp = self._status = None
        if hasattr(self._device, "stop"):
            self._call(self._device.stop)

    def _release(self) -> None:
        if hasattr(self._device, "destroy"):
            self._device.destroy()
        self._call.end()


def build(section: Section, context: BuildContext) -> OphydStage:
    """Import the device, make it and connect it."""
    settings, path = stated_axis(section), section.word("device")
    arguments, named = section.values.get("arguments", []), section.table("named").values
    if not isinstance(arguments, list):
        section.refuse("arguments", f"must be a list, but is {arguments!r}.")
    module, _, name = path.partition(":")
    call = _Caller()
    try:
        device: Any = import_module(module)
        for part in name.split("."):
            device = getattr(device, part)
        if isinstance(device, type) or not hasattr(device, "set"):
            if any(iscoroutinefunction(getattr(device, each, None)) for each in ("connect", "locate")):
                call.start()
            device = call(lambda: device(*arguments, **named))
        elif iscoroutinefunction(getattr(device, "connect", None)):
            call.start()
        if iscoroutinefunction(getattr(device, "connect", None)):
            call(device.connect, within_s=CONNECTS_S)
        elif hasattr(device, "wait_for_connection"):
            device.wait_for_connection(timeout=CONNECTS_S)
    except Exception as error:  # the device is somebody else's code
        call.end()
        section.refuse(
            "device", f"must be importable as MODULE:NAME and connect, but {path} did not ({in_a_line(error)})."
        )
    speed = section.word("speed", "velocity" if hasattr(device, "velocity") else "")
    per_mm = section.number("units_per_mm", 1.0, above=0.0)
    return OphydStage(device, call, speed, section.word("home", ""), per_mm, context.clock, settings).at_rest()

"""The test bed: actuator, force sensor, camera and clock of one experiment, and requests to its operator."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fingervision.domain.errors import DeviceError, LimitError, StateError
from fingervision.domain.model import Model
from fingervision.measuring.scale import Scale
from fingervision.testbed.actuator import Actuator
from fingervision.testbed.camera import BedCamera
from fingervision.testbed.cameras.simulated import SHIFT_MM, Placed, SimulatedCamera
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import ForceSensor
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.terminal import TERMINAL
from fingervision.testbed.text_protocol.sensor import TextSensor


@dataclass(frozen=True, slots=True)
class Request:
    """What an operator is asked to do: in words, and as the change of a simulated part's placement."""

    words: str
    change: Callable[[Placed], Placed]


TURN = Request("Turn the part by 180 degrees in the picture.", lambda placed: replace(placed, turned=not placed.turned))
# The second shift brings the picture back.
SHIFT = Request(
    "Shift the camera, so that the fingers appear at another place in the picture.",
    lambda placed: replace(placed, shift_mm=SHIFT_MM - placed.shift_mm),
)
TAKE_OUT_SLOT = Request(
    "Take the reference slot away, so that the camera sees the fingers again.",
    lambda placed: replace(placed, slot_mm=None),
)


def put_in_slot(size_mm: float) -> Request:
    """Request to put a reference slot in place of the fingers."""
    words = f"Put the reference slot of {size_mm:g} mm in the plane of the fingers, in front of the camera."
    return Request(words, lambda placed: replace(placed, slot_mm=size_mm))


@dataclass(frozen=True, slots=True, eq=False)
class Bed:
    """The parts of one experiment; each part is either real or simulated.

    Parameters
    ----------
    clock : Clock
        Clock whose time all parts use.
    actuator : Actuator
        Actuator of the drive point.
    limits : SoftLimits
        Limits for all requested motions.
    force_sensor : ForceSensor or None
        Sensor of the force at the drive.
    camera : BedCamera or None
        Camera that views the fingers.
    scale : Scale or None
        Conversion from the camera's pixels to millimetres.
    below_tip_mm : float
        Distance of the measuring point below each finger's tip.
    model : Model or None
        Expected behaviour of the gripper: its drawing or table, without injected effects.
    replays : bool
        Whether the same commands give the same results, so that an interrupted run can be brought back to its state.
    about : mapping
        Description for run.json.
    channels : mapping of str to TextSensor
        Further quantities that are recorded with each frame, by the names of their columns.
    """

    clock: Clock
    actuator: Actuator
    limits: SoftLimits
    force_sensor: ForceSensor | None = None
    camera: BedCamera | None = None
    scale: Scale | None = None
    below_tip_mm: float = 0.3
    model: Model | None = None
    replays: bool = False
    about: Mapping[str, Any] = field(default_factory=dict)
    channels: Mapping[str, TextSensor] = field(default_factory=dict)

    def operate(self, request: Request) -> None:
        """Let the operator do something: a person on the terminal, or the simulation, which does it at once."""
        if self.replays and isinstance(self.camera, SimulatedCamera):
            self.camera.place(request.change(self.camera.placed))
        elif TERMINAL.ask(f"{request.words} Press Enter when it is done: ") is None:
            raise StateError(
                f"The recipe asks the operator ({request.words.rstrip('.').lower()}), but there is no terminal: run "
                "the command from a terminal."
            )

    def check(self, force_n: float | None, limit_n: float, where: str = "") -> None:
        """Refuse to go on with an alarm of the actuator, or with a force (None: not measured) beyond a limit.

        Raises
        ------
        DeviceError, LimitError
            With the alarm, or with the force; `where` is added to it.
        """
        alarm = self.actuator.alarm
        if alarm is not None:
            raise DeviceError(f"The actuator has an alarm ({alarm.code}: {alarm.words}): the motor was stopped.")
        if force_n is not None and abs(force_n) > limit_n:
            raise LimitError(
                f"The force must stay below {limit_n:g} N, but is {force_n:.3g} N{where}: the motor was stopped."
            )

    def close(self) -> None:
        """Stop the motor first, then release all hardware."""
        self.actuator.close()
        if self.force_sensor is not None:
            self.force_sensor.close()
        if self.camera is not None:
            self.camera.close()
        for channel in self.channels.values():
            channel.close()

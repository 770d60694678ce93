"""The test bed: actuator, force sensor, camera and clock of one experiment, and its operator."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fingervision.domain.errors import DeviceError, LimitError, StateError
from fingervision.domain.model import Model
from fingervision.measuring.scale import Scale
from fingervision.testbed.actuator import Actuator
from fingervision.testbed.camera import BedCamera
from fingervision.testbed.cameras.simulated import SHIFT_MM, SimulatedCamera
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import ForceSensor
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.terminal import TERMINAL
from fingervision.testbed.text_protocol.sensor import TextSensor


class Operator:
    """The operator of a test bed: a person who receives requests on the terminal, and confirms when a step is done."""

    def turn_part(self) -> None:
        """Ask the person on the terminal to turn the part, and wait for the confirmation."""
        self._ask("Turn the part by 180 degrees in the picture.")

    def shift_picture(self) -> None:
        """Ask the person on the terminal to shift the picture, and wait for the confirmation."""
        self._ask("Shift the camera, so that the fingers appear at another place in the picture.")

    def put_in_slot(self, size_mm: float) -> None:
        """Ask the person on the terminal to insert the reference slot, and wait for the confirmation."""
        self._ask(f"Put the reference slot of {size_mm:g} mm in the plane of the fingers, in front of the camera.")

    def take_out_slot(self) -> None:
        """Ask the person on the terminal to remove the reference slot, and wait for the confirmation."""
        self._ask("Take the reference slot away, so that the camera sees the fingers again.")

    def _ask(self, words: str) -> None:
        if TERMINAL.ask(f"{words} Press Enter when it is done: ") is None:
            raise StateError(
                f"The recipe asks the operator ({words.rstrip('.').lower()}), but there is no terminal: run the "
                "command from a terminal."
            )


class AtTheSimulation(Operator):
    """Operator of a simulated test bed: the placement of the simulated part changes at once.

    Parameters
    ----------
    camera : SimulatedCamera
        The camera in front of which the part is placed.
    """

    def __init__(self, camera: SimulatedCamera) -> None:
        self._camera = camera

    def turn_part(self) -> None:
        """Turn the simulated part."""
        placed = self._camera.placed
        self._camera.place(replace(placed, turned=not placed.turned))

    def shift_picture(self) -> None:
        """Shift the simulated part, and shift it back at the next call."""
        placed = self._camera.placed
        self._camera.place(replace(placed, shift_mm=SHIFT_MM - placed.shift_mm))

    def put_in_slot(self, size_mm: float) -> None:
        """Render a slot in place of the fingers."""
        self._camera.place(replace(self._camera.placed, slot_mm=size_mm))

    def take_out_slot(self) -> None:
        """Render the fingers again."""
        self._camera.place(replace(self._camera.placed, slot_mm=None))


def operator_of(camera: BedCamera | None) -> Operator:
    """Choose the operator of a test bed according to its camera."""
    return AtTheSimulation(camera) if isinstance(camera, SimulatedCamera) else Operator()


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
    operator : Operator
        Performs manual actions: turns the part, shifts the picture, inserts a slot.
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
    operator: Operator
    force_sensor: ForceSensor | None = None
    camera: BedCamera | None = None
    scale: Scale | None = None
    below_tip_mm: float = 0.3
    model: Model | None = None
    replays: bool = False
    about: Mapping[str, Any] = field(default_factory=dict)
    channels: Mapping[str, TextSensor] = field(default_factory=dict)

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

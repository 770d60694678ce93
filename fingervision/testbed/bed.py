"""The test bed: actuator, force sensor, camera and clock of one experiment."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fingervision.domain.errors import DeviceError, LimitError
from fingervision.domain.model import Model
from fingervision.measuring.scale import Scale
from fingervision.testbed.actuator import Actuator
from fingervision.testbed.camera import BedCamera
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import ForceSensor
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.operator import Operator
from fingervision.testbed.text_protocol.sensor import TextSensor


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

"""A force sensor that talks in lines of text, by the words of a TOML file: a load cell board, a multimeter, a balance.

`scale` is the force of a unit in newtons, `zero` the number without a force. Tested against an emulated HX711 board and
multimeter, and pyvisa-sim's instruments; not on hardware.
"""

from dataclasses import dataclass

from fingervision.storage.toml_section import Section
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.motion.move_limits import ENDLESS_N
from fingervision.testbed.reading import Reading
from fingervision.testbed.text_protocol import sensor
from fingervision.testbed.text_protocol.sensor import TextSensor, opened_sensor

KEYS = ("full_scale_n", *sensor.KEYS)
SIMULATED = False


@dataclass(frozen=True, slots=True, eq=False)
class TextForceSensor:
    """A force sensor; each call waits for a force that is new, because a limit is monitored by it.

    Parameters
    ----------
    sensor : TextSensor
        The instrument.
    full_scale_n : float
        Largest force that the sensor can measure.
    """

    sensor: TextSensor
    full_scale_n: float

    @property
    def name(self) -> str:
        """Name of the instrument."""
        return self.sensor.name

    def readings(self) -> tuple[Reading, ...]:
        """Forces since the last call, the oldest first."""
        return self.sensor.waited()

    def close(self) -> None:
        """Release the port."""
        self.sensor.close()


def build(section: Section, context: BuildContext) -> TextForceSensor:
    """Open the instrument that the configuration states."""
    full_scale_n = section.number("full_scale_n", ENDLESS_N, above=0.0)
    return TextForceSensor(opened_sensor(section, context), full_scale_n)

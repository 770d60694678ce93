"""A force sensor that talks in lines of text, by the words of a TOML file: a load cell board, a multimeter, a balance.

`scale` is the force of a unit in newtons, `zero` the number without a force. Tested against an emulated HX711 board and
multimeter, and pyvisa-sim's instruments; not on hardware.
"""

from fingervision.storage.toml_section import Section
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.motion.move_limits import ENDLESS_N
from fingervision.testbed.text_protocol import sensor
from fingervision.testbed.text_protocol.sensor import TextSensor, opened_sensor

KEYS = ("full_scale_n", *sensor.KEYS)
SIMULATED = False


def build(section: Section, context: BuildContext) -> TextSensor:
    """Open the instrument that the configuration states."""
    full_scale_n = section.number("full_scale_n", ENDLESS_N, above=0.0)
    sensor = opened_sensor(section, context)
    sensor.full_scale_n = full_scale_n
    return sensor

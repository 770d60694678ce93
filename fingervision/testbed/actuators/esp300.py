"""A Newport ESP300 or ESP301: kind `serial_text` with the words `newport_esp`, under the name of earlier versions."""

from dataclasses import replace

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuators import serial_text
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import without_hardware
from fingervision.testbed.build_context import BuildContext

__all__ = ["KEYS", "SIMULATED", "build", "without_hardware"]
KEYS = ("port", "baud", "axis", *AXIS)
SIMULATED = False


def build(section: Section, context: BuildContext) -> serial_text.TextStage:
    """Open the controller; `port` is a serial port, or a VISA resource such as `GPIB0::1::INSTR`."""
    axis = section.whole("axis", 1, low=1, high=3)
    rest = {key: value for key, value in section.values.items() if key != "axis"}
    return serial_text.build(replace(section, values={**rest, "words": "newport_esp", "set": {"axis": axis}}), context)

"""A Zaber stage: kind `serial_text` with the words `zaber`, by the stage's microstep size from its data sheet."""

from dataclasses import replace

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuators import serial_text
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import without_hardware
from fingervision.testbed.build_context import BuildContext

__all__ = ["KEYS", "SIMULATED", "build", "without_hardware"]
KEYS = ("port", "device", "axis", "microstep_mm", *AXIS)
SIMULATED = False
SPEED_UNIT = 1.6384
"""Value of one microstep per second in native speed units (Zaber, "ASCII Protocol Manual", maxspeed)."""


def build(section: Section, context: BuildContext) -> serial_text.TextStage:
    """Open the device; `port` is a serial port, or HOST:PORT of a controller in the network."""
    per_mm = 1.0 / section.number("microstep_mm", above=0.0)
    host, _, number = section.word("port").rpartition(":")
    port = f"socket://{host}:{number}" if host and number.isdigit() and "//" not in host else section.word("port")
    given = {
        "device": section.whole("device", 1, low=1, high=99),
        "axis": section.whole("axis", 1, low=1, high=9),
        "per_mm": per_mm,
        "speed_per_mm_s": per_mm * SPEED_UNIT,
    }
    own = ("device", "axis", "microstep_mm")
    rest = {key: value for key, value in section.values.items() if key not in own}
    return serial_text.build(replace(section, values={**rest, "port": port, "words": "zaber", "set": given}), context)

"""Every kind of real stage with what it is tested against: an emulator, and the lines of its test bed's file."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.testbed.stages import emulators

LIMITS = "lower_mm = -2\nupper_mm = 8\nspeed_mm_s = 5\naccuracy_mm = 0.002\nsettling_s = 0.2\n"
CAMERA = """
[camera]
kind = "simulated"
rate_hz = 100.0
[gripper]
[scale]
px_per_mm = 34.0
"""


@dataclass(frozen=True)
class Case:
    """A kind of stage; the emulator has `plant`, `port`, `plug`, `unplug`, `close`, and maybe `nonsense`, `silent`."""

    make: Callable[[], Any]
    lines: str
    library: str = ""

    def bed_at(self, folder: Path, emulator: Any, camera: str = "", limits: str = LIMITS) -> Path:
        path = folder / "bed.toml"
        actuator = self.lines.replace("PORT", emulator.port)
        path.write_text(
            f"schema = 1\n[actuator]\n{actuator}\n{limits}[limits]\nlower_mm = -0.4\nupper_mm = 6\n{camera}",
            encoding="utf-8",
        )
        return path


def text(words: str, more: str = "") -> str:
    return f'kind = "serial_text"\nwords = "{words}"\nport = "PORT"\n{more}'


CASES: dict[str, Case] = {
    "grbl": Case(emulators.Grbl, text("grbl")),
    "marlin": Case(emulators.Marlin, text("marlin", f"set = {{ steps_per_mm = {emulators.STEPS_PER_MM} }}\n")),
    "pi_gcs": Case(emulators.PiGcs, text("pi_gcs")),
    "smaract_mcs": Case(emulators.SmarAct, text("smaract_mcs")),
    "newport_esp": Case(emulators.NewportEsp, text("newport_esp")),
    "esp300": Case(emulators.NewportEsp, 'kind = "esp300"\nport = "PORT"\naxis = 1\n'),
    "kinesis": Case(
        emulators.Kinesis,
        f'kind = "kinesis"\nport = "PORT"\ncontroller = "dc_servo"\ncounts_per_mm = {emulators.COUNTS_PER_MM}\n',
    ),
}

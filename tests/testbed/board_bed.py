"""Configuration files of test beds with the emulated board: wiring, steps of the motor controller, and the bed."""

from collections.abc import Callable
from pathlib import Path

from fingervision.domain.step_data import StepData
from fingervision.storage.recipe_toml import read_steps
from fingervision.testbed.motion.motion_profile import profile
from fingervision.testbed.motion.move_limits import PUBLISHED

BOARD = """schema = 1
port = "{port}"
silence_ms = 95
[lines]
select = ["D2", "D3", "D4", "D5"]
drive = "D6"
enable = "D7"
hold = "D11"
busy = "D8"
alarm = "D9"
force = "A0"
active_low = ["busy", "alarm"]
"""
BED = """schema = 1
[actuator]
kind = "board"
board = "board.toml"
steps = "steps.toml"
home_code = 0
enable_s = 0.0
lower_mm = {lower_mm}
[force_sensor]
kind = "board"
board = "board.toml"
volts = [0.5, 4.5]
newtons = [0.0, 5.0]
[limits]
force_n = 3.0
upper_mm = 9.5
"""
# Steps for all motions in the contract tests of actuators; step n has code n, homing code 0. Step 8 is for jogs.
SPEEDS = ((0.0, 2.0), (0.5, 2.0), (-0.2, 2.0), (1.0, 2.0), (0.7, 2.0), (0.5, 1.0), (1.0, 1.0), (5.0, 0.5))
CONTRACT_STEPS = "schema = 1\n" + "".join(
    f"[[step]]\ntarget_mm = {target_mm}\nload_kg = 0.1\nspeed_mm_s = {speed_mm_s}\nacceleration_mm_s2 = 1000.0\n"
    f'deceleration_mm_s2 = 1000.0\ncoordinates = "{"relative" if target_mm == 5.0 else "absolute"}"\n'
    for target_mm, speed_mm_s in SPEEDS
)


def written_bed(folder: Path, port: str, steps: str, lower_mm: float = 0.0) -> Path:
    """Write the files of a test bed; return the path of its configuration."""
    (folder / "steps.toml").write_text(steps, encoding="utf-8")
    (folder / "board.toml").write_text(BOARD.format(port=port), encoding="utf-8")
    (folder / "bed.toml").write_text(BED.format(lower_mm=lower_mm), encoding="utf-8")
    return folder / "bed.toml"


def times_of(path: Path) -> Callable[[int], float]:
    """Duration for which a motor controller with these steps is busy with each code, from its present position."""
    data: StepData = read_steps(path)
    at_mm = data.start_mm

    def seconds(code: int) -> float:
        nonlocal at_mm
        if code not in data.steps:
            at_mm = 0.0
            return 0.05
        to_mm = data.steps[code].end_mm(at_mm)
        motion = profile(to_mm - at_mm, data.steps[code].entry, PUBLISHED.speed_mm_s)
        at_mm = to_mm
        return motion.seconds

    return seconds

"""TOML and JSON files with a character changed here and there: read, or refused in a sentence; nothing else.

Run as `python -m tests.benchmarks.mutated_documents [--files 2000] [--seed 1]` from the top. Whole documents of every
kind that is read (gripper, corrected model, recipe, board settings, calibration) get 1 to 5 changes: characters lost,
doubled or replaced, numbers replaced by nan, inf, text, lists, a number of 400 digits. Printed for each kind: files,
files that were read, refused ones, faults (anything else than a sentence), and results with a number that is none.
"""

import math
import re
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np

from fingervision.domain.errors import FingervisionError
from fingervision.storage.board_toml import read_board
from fingervision.storage.calibration_json import read_calibration
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.model_toml import read_model
from fingervision.storage.recipe_toml import read_recipe, read_steps
from fingervision.storage.toml_section import Section
from tests.benchmarks.frame import Namespace, Tally, benchmark

MODEL = """schema = 1
base = "simulation.csv"
[[effect]]
name = "backlash"
[effect.parameters]
play_mm = { value = 0.0101, u = 0.0002 }
"""
RECIPE = """schema = 1
name = "two speeds"
below_force_n = 5.0
[[step]]
kind = "triangle"
from_mm = -0.3
to_mm = 1.5
speed_mm_s = 0.5
cycles = 2
frames = "continuous"
[[step]]
kind = "move"
to_mm = 0.3
speed_mm_s = 0.5
"""
STEP_DATA = """schema = 1
name = "open and push"
[[step]]
target_mm = 5.0
load_kg = 0.2
positioning_time_s = 0.2
[[step]]
target_mm = 0.5
coordinates = "relative"
load_kg = 0.2
speed_mm_s = 20.0
acceleration_mm_s2 = 1000.0
deceleration_mm_s2 = 500.0
"""
BOARD = """schema = 1
port = "/dev/ttyACM0"
force_rate_hz = 100
[lines]
select = ["D8", "D9", "D10", "D11"]
drive = "D12"
busy = "D2"
alarm = "D3"
force = "A5"
active_low = ["busy", "select"]
"""
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?")
ODD = (
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "1e9",
    "1e308",
    "'text'",
    '"text"',
    "[]",
    "[1]",
    "{}",
    "true",
    "9" * 400,
    "9" * 5000,
    "[" * 2000,
    "",
)


def mutated(text: str, rng: np.random.Generator) -> str:
    """Change a document in 1 to 5 places."""
    for _ in range(int(rng.integers(1, 6))):
        numbers = list(NUMBER.finditer(text))
        if numbers and rng.random() < 0.6:
            found = numbers[int(rng.integers(len(numbers)))]
            text = text[: found.start()] + str(rng.choice(ODD)) + text[found.end() :]
            continue
        at = int(rng.integers(len(text)))
        new = str(
            rng.choice(["", text[at] * 2, chr(int(rng.integers(32, 127))), "\n", "\x00", "\u00e9", '"', "[", "="])
        )
        text = text[:at] + new + text[at + 1 :]
    return text


def is_sound(value: object, depth: int = 0) -> bool:
    """Whether every number in it is one."""
    if isinstance(value, float):
        return not math.isnan(value)
    if isinstance(value, np.ndarray):
        return value.dtype.kind not in "fc" or not bool(np.isnan(value).any())
    if depth > 6:
        return True
    if isinstance(value, Section):  # as it stands in the file; who asks it for a number gets a number or a sentence
        return True
    if is_dataclass(value) and not isinstance(value, type):
        return all(is_sound(getattr(value, each.name), depth + 1) for each in fields(value))
    if isinstance(value, dict):
        return all(is_sound(each, depth + 1) for each in value.values())
    if isinstance(value, list | tuple):
        return all(is_sound(each, depth + 1) for each in value)
    return True


@benchmark(files=2000, seed=1)
def main(chosen: Namespace) -> None:
    """Print the table."""
    rng = np.random.default_rng(chosen.seed)
    top = Path(__file__).parents[2]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "simulation.csv").write_text("input_mm,gap_mm\n0,1\n1,2\n", encoding="utf-8")
        calibration = (top / "sample_frames/opening/calibration.json").read_text(encoding="utf-8")
        kinds: dict[str, tuple[str, str, Callable[[Path], object]]] = {
            "gripper": (".toml", (top / "sample_frames/paper/gripper.toml").read_text(encoding="utf-8"), read_gripper),
            "model": (".toml", MODEL, read_model),
            "recipe": (".toml", RECIPE, read_recipe),
            "step data": (".toml", STEP_DATA, read_steps),
            "board": (".toml", BOARD, read_board),
            "calibration": (".json", calibration, read_calibration),
        }
        tally, seen = Tally("files", "read", "refused", "faults", "no numbers"), Counter[str]()
        for kind, (suffix, text, read) in kinds.items():
            for _ in range(chosen.files // len(kinds)):
                path = folder / f"mutated{suffix}"
                path.write_text(mutated(text, rng), encoding="utf-8")
                try:
                    came = ["read"] if is_sound(read(path)) else ["read", "no numbers"]
                except FingervisionError:
                    came = ["refused"]
                except Exception as error:
                    came = ["faults"]
                    place = traceback.extract_tb(error.__traceback__)[-1]
                    seen[f"{kind}: {type(error).__name__}: {error} at {place}"[:200]] += 1
                tally.add([kind], ["files", *came])
    tally.show()
    for words, times in seen.most_common():
        print(f"    {times} x {words}")

"""Recipes and simulated test beds for tests of runs."""

from collections.abc import Callable
from pathlib import Path

from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import RunDone, run_recipe
from fingervision.testbed.simulation.injected_effects import NOTHING, Hidden

# One second of motion, then a few points at rest: the shortest run with every kind of phase that can be interrupted.
SHORT = """
schema = 1
name = "short"

[[step]]
kind = "triangle"
from_mm = -0.2
to_mm = 0.4
speed_mm_s = 1.0

[[step]]
kind = "staircase"
from_mm = -0.2
to_mm = 0.4
steps = 2
dwell_s = 0.1
speed_mm_s = 1.0
frames = 3

[[step]]
kind = "rezero"

[[step]]
kind = "move"
to_mm = 0.3
speed_mm_s = 1.0
"""


def recipe_at(folder: Path, text: str = SHORT) -> Path:
    """Write a recipe."""
    path = folder / "recipe.toml"
    path.write_text(text, encoding="utf-8")
    return path


def steps(*tables: str) -> str:
    """Text of a recipe; each step is given as lines `key = value`."""
    return "schema = 1\n" + "".join(f"\n[[step]]\n{table}\n" for table in tables)


def run(
    folder: Path,
    text: str = SHORT,
    hidden: Hidden = NOTHING,
    bed_name: str = "simulated",
    say: Callable[[str], None] = lambda words: None,
) -> RunDone:
    """Run a recipe on a test bed and write the results to a folder named run."""
    bed = open_bed(bed_name, hidden)
    try:
        return run_recipe(read_recipe(recipe_at(folder, text)), bed, folder / "run", hidden, say=say)
    finally:
        bed.close()


LIVE_CAMERA = """schema = 1
[actuator]
kind = "simulated"
[camera]
kind = "source"
source = "simulated"
patience_s = 60.0
latency_s = 0.0
u_latency_s = 0.001
[scale]
px_per_mm = 34.0
[limits]
lower_mm = -0.4
upper_mm = 1.4
"""


def live_camera_at(folder: Path) -> Path:
    """A test bed with a simulated stage and a camera that runs continuously, so that a run cannot be replayed."""
    path = folder / "live.toml"
    path.write_text(LIVE_CAMERA, encoding="utf-8")
    return path

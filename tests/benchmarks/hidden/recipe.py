"""A proposed run as motions: steps of a recipe that move the stage, simulated with the same effects."""

import tomllib
from pathlib import Path
from typing import Any

from tests.benchmarks.hidden.experiment import Experiment
from tests.benchmarks.hidden.motion import Motion, hold, sine, staircase, through, triangle
from tests.benchmarks.hidden.plant import Trace


class NotDrivenError(ValueError):
    """The recipe has a step that cannot be simulated."""


def _motion(step: dict[str, Any], now_mm: float, closed_mm: float) -> Motion:
    match step["kind"]:
        case "triangle":
            return triangle(step["from_mm"], step["to_mm"], step["speed_mm_s"], int(step["cycles"]))
        case "staircase":
            ends = step["from_mm"], step["to_mm"]
            return staircase(*ends, int(step["steps"]), step["dwell_s"], step["speed_mm_s"])
        case "sine":
            return sine(step["mean_mm"], step["amplitude_mm"], step["frequency_hz"], step["cycles"])
        case "hold":
            return hold(step["at_mm"], step["seconds"])
        case "move":
            return through([now_mm, step["to_mm"]], step["speed_mm_s"])
        case "close_until_contact":
            return through([now_mm, closed_mm], step["speed_mm_s"])
        case kind:
            raise NotDrivenError(f"A step must move the stage here, but is {kind}.")


def motions_of(path: Path, closed_mm: float) -> list[Motion]:
    """Runs of a recipe: only one, because a step that begins another run (`rezero`) cannot be simulated."""
    recipe = tomllib.loads(path.read_text(encoding="utf-8"))
    motion: Motion | None = None
    for step in recipe["step"]:
        more = _motion(step, motion.position_mm[-1] if motion else 0.0, closed_mm)
        motion = more if motion is None else motion.then(more)
    return [motion] if motion else []


def drive(experiment: Experiment, motions: list[Motion]) -> list[Trace]:
    """Simulate further runs after those of the table."""
    design = experiment.design
    started = 0.0 if design.time_restarts else experiment.starts_s()[-1] + design.motions[-1].duration_s + 30.0
    traces = []
    for k, motion in enumerate(motions):
        begin = started if not design.time_restarts else 0.0
        traces.append(experiment.plant.trace(motion, design.rate_hz, begin, len(design.motions) + k))
        started += motion.duration_s + 30.0
    return traces


def drive_recipe(experiment: Experiment, path: Path) -> list[Trace]:
    """Simulate the runs of a recipe after those of the table."""
    return drive(experiment, motions_of(path, experiment.plant.inputs.lower_mm))

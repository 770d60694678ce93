"""Closed loop on rendered frames: effects added to the simulated test bed, and their diagnosis after `bed run`.

Run as `python -m tests.benchmarks.closed_loop [--out DIR] [--first N] [--seeds N]` from the project's folder; N
successive seeds are used, starting with the first. Each effect is added alone (with its usual size). Printed are the
verdict, and names and parameters next to the true values; the last line is without an effect.
"""

import time
from pathlib import Path
from typing import Any

from fingervision.diagnosis.diagnose import diagnose
from fingervision.effects import catalogue
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from fingervision.storage.recipe_toml import read_recipe, write_recipe
from fingervision.storage.summary_json import report_document
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.run.run_folder import SAMPLES, SIMULATION
from fingervision.testbed.simulation.injected_effects import Hidden, usual_values
from tests.benchmarks.frame import Namespace, benchmark

NAMED = (
    "backlash", "friction_hysteresis", "stick_slip", "encoder_cyclic_error", "end_stop", "finger_contact",
    "assembly_asymmetry", "viscoelastic_creep", "thermal_drift", "lens_distortion", "camera_tilt", "camera_drift",
)  # fmt: skip
RICH: tuple[dict[str, object], ...] = (
    {"kind": "triangle", "from_mm": -0.42, "to_mm": 1.3, "speed_mm_s": 0.4, "cycles": 1},
    {"kind": "hold", "at_mm": 1.0, "seconds": 5.0},
    {"kind": "rezero"},
    {"kind": "triangle", "from_mm": -0.42, "to_mm": 1.3, "speed_mm_s": 0.17, "cycles": 1},
    {"kind": "hold", "at_mm": 0.2, "seconds": 5.0},
)


def answered(name: str, seed: int, folder: Path) -> dict[str, Any]:
    """Add an effect, run the recipe, and diagnose the result."""
    folder.mkdir(parents=True, exist_ok=True)
    write_recipe(folder / "recipe.toml", "benchmark", RICH)
    bed = open_bed("simulated", hidden_as(name), seed=seed)
    try:
        done = run_recipe(read_recipe(folder / "recipe.toml"), bed, folder / "run", hidden_as(name))
    finally:
        bed.close()
    answer = diagnose(read_measured_table(folder / "run" / SAMPLES), read_model(folder / "run" / SIMULATION), seed=seed)
    return {**report_document(answer.report, "", None), "frames": done.counts.recorded}


def hidden_as(name: str) -> Hidden:
    """One effect with its usual size; no effect for `nothing`."""
    return Hidden({} if name == "nothing" else {name: usual_values(catalogue()[name])})


def named(out: Path, seeds: range) -> None:
    """Print the table of results for single effects."""
    print(f"{'hidden':22} {'frames':>6} {'verdict':9} {'found':34} right  truth -> found (s of processor)", flush=True)
    right = 0
    cases = [(name, seed) for seed in seeds for name in (*NAMED, "nothing")]
    for name, seed in cases:
        began = time.process_time()
        report = answered(name, seed, out / f"{name}-{seed}")
        found = {effect["name"]: effect["parameters"] for effect in report["effects"]}
        is_right = report["verdict"] == ("agrees" if name == "nothing" else "named") and set(found) == (
            set() if name == "nothing" else {name}
        )
        right += is_right
        truth = hidden_as(name).effects.get(name, {})
        words = ", ".join(
            f"{key} {value:.4g} -> {found[name][key]['value']:.4g}" for key, value in truth.items() if name in found
        )
        print(
            f"{name:22} {report['frames']:6d} {report['verdict']:9} {'+'.join(found) or '-':34} "
            f"{'yes' if is_right else 'NO ':5}  {words} ({time.process_time() - began:.0f})",
            flush=True,
        )
    print(f"right: {right} of {len(cases)}")


@benchmark(
    out=Path("build/closed_loop"),
    first={"type": int, "default": 1, "help": "the first seed"},
    seeds={"type": int, "default": 1, "help": "how many"},
)
def main(chosen: Namespace) -> None:
    """Print the table."""
    named(chosen.out, range(chosen.first, chosen.first + chosen.seeds))

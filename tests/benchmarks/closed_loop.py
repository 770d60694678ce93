"""Closed loop on rendered frames: effects added to the simulated test bed, and their diagnosis after `bed run`.

Run as `python -m tests.benchmarks.closed_loop [--part named|open|all] [--out DIR] [--first N] [--seeds N]` from the
project's folder; N successive seeds are used, starting with the first.

The part `named` adds each effect alone (with its usual size), runs RICH, and prints the verdict, and names and
parameters next to the true values; the last line is without an effect. The part `open` begins with POOR, a one-way run
of 40 frames. If the diagnosis is then ambiguous, the proposed run is executed on the same test bed. Printed are whether
the final diagnosis is right, and the predicted and the actual gain: the increase, by the second run, of the chi-square
by which other explanations are worse than the truth.
"""

import json
import time
from pathlib import Path
from typing import Any

from fingervision.diagnosis.diagnose import diagnose
from fingervision.effects import catalogue
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from fingervision.storage.recipe_toml import read_recipe, write_recipe
from fingervision.storage.report_json import report_document
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.run.run_folder import JOINED, SAMPLES, SIMULATION, rows_before, times_of
from fingervision.testbed.simulation.injected_effects import Hidden
from fingervision.testbed.simulation.parse_injected_effects import usual_values
from tests.benchmarks.frame import Namespace, benchmark

NAMED = (
    "backlash", "friction_hysteresis", "stick_slip", "encoder_cyclic_error", "end_stop", "finger_contact",
    "assembly_asymmetry", "viscoelastic_creep", "thermal_drift", "lens_distortion", "camera_tilt", "camera_drift",
)  # fmt: skip
ALSO_OPEN = (
    "drive_lag", "input_offset", "input_scale", "lever_ratio_error", "rest_gap_error", "scale_error", "camera_latency",
)  # fmt: skip
RICH: tuple[dict[str, object], ...] = (
    {"kind": "triangle", "from_mm": -0.42, "to_mm": 1.3, "speed_mm_s": 0.4, "cycles": 1},
    {"kind": "hold", "at_mm": 1.0, "seconds": 5.0},
    {"kind": "rezero"},
    {"kind": "triangle", "from_mm": -0.42, "to_mm": 1.3, "speed_mm_s": 0.17, "cycles": 1},
    {"kind": "hold", "at_mm": 0.2, "seconds": 5.0},
)
POOR: tuple[dict[str, object], ...] = ({"kind": "move", "to_mm": 1.3, "speed_mm_s": 0.93},)


def answered(name: str, seed: int, steps: tuple[dict[str, object], ...], folder: Path) -> dict[str, Any]:
    """Add an effect, run the recipe, and diagnose the result."""
    folder.mkdir(parents=True, exist_ok=True)
    recipe = folder / "recipe.toml"
    write_recipe(recipe, "benchmark", steps)
    return followed(name, seed, recipe, folder / "run", None)


def hidden_as(name: str) -> Hidden:
    """One effect with its usual size; no effect for `nothing`."""
    return Hidden({} if name == "nothing" else {name: usual_values(catalogue()[name])})


def followed(name: str, seed: int, recipe: Path, out: Path, before: Path | None) -> dict[str, Any]:
    """Run a recipe, possibly after an earlier run, and diagnose all data recorded so far."""
    rows = [] if before is None else rows_before(before)
    bed = open_bed("simulated", hidden_as(name), seed=seed, earlier_s=times_of(rows))
    try:
        done = run_recipe(read_recipe(recipe), bed, out, hidden_as(name), before=rows)
    finally:
        bed.close()
    table = read_measured_table(out / (SAMPLES if before is None else JOINED))
    answer = diagnose(table, read_model(out / SIMULATION), seed=seed)
    proposal = answer.report.next_run
    if proposal is not None:
        write_recipe(out.parent / f"{out.name}-next.toml", proposal.name, proposal.steps)
    return {**report_document(answer.report, "", None), "frames": done.counts.recorded}


def behind(report: dict[str, Any], truth: str, rival: str) -> float | None:
    """Chi-square by which another explanation is worse than the truth; None if the report does not list it."""
    listed = {"+".join(each["effects"]): each["chi_square_more_than_best"] for each in report["runners_up"]}
    best = "+".join(effect["name"] for effect in report["effects"])
    listed[best] = 0.0
    if rival not in listed or truth not in listed:
        return None
    return float(listed[rival] - listed[truth])


def named(out: Path, seeds: range) -> None:
    """Print the table of results for single effects."""
    print(f"{'hidden':22} {'frames':>6} {'verdict':9} {'found':34} right  truth -> found (s of processor)", flush=True)
    right = 0
    cases = [(name, seed) for seed in seeds for name in (*NAMED, "nothing")]
    for name, seed in cases:
        began = time.process_time()
        report = answered(name, seed, RICH, out / f"named-{name}-{seed}")
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


def opened(out: Path, seeds: range) -> None:
    """Print the predicted and actual gains of the proposed second runs."""
    print(
        f"{'hidden':22} {'first':9} {'alternatives':>12} {'proposed':24} {'then':9} {'found':28} promised  came",
        flush=True,
    )
    open_, resolved, proposed, kept, promises = 0, 0, 0, 0, 0
    for seed in seeds:
        for name in (*NAMED, *ALSO_OPEN):
            folder = out / f"open-{name}-{seed}"
            first = answered(name, seed, POOR, folder)
            proposal = first["next_run"]
            line = f"{name:22} {first['verdict']:9} {len(first['alternatives']):12d}"
            open_ += first["verdict"] == "ambiguous"
            if first["verdict"] != "ambiguous" or proposal is None:
                print(line, flush=True)
                continue
            proposed += 1
            try:
                then = followed(name, seed, folder / "run-next.toml", folder / "second", folder / "run")
            except Exception as error:
                print(f"{line} could not be run: {error}", flush=True)
                continue
            found = "+".join(effect["name"] for effect in then["effects"])
            resolved += then["verdict"] == "named" and found == name
            promised = float(proposal["promised"]["gain"])
            gains = [
                after - before
                for rival in proposal["separates"]
                if rival != name
                and (before := behind(first, name, rival)) is not None
                and (after := behind(then, name, rival)) is not None
            ]
            came = min(gains) if gains and name in proposal["separates"] else None
            if promised >= 75.0 and came is not None:
                promises += 1
                kept += 0.7 <= came / promised <= 1.3
            print(
                f"{line} {proposal['words'].partition(':')[0][:24]:24} {then['verdict']:9} {found[:28]:28} "
                f"{promised:8.0f}  {'-' if came is None else f'{came:.0f}'}",
                flush=True,
            )
    print(
        f"open: {open_}, a run proposed: {proposed}, resolved by it: {resolved}; "
        f"promises of 75 and more within 0.7 to 1.3: {kept} of {promises}"
    )


@benchmark(
    part={"choices": ("named", "open", "all"), "default": "all"},
    out=Path("build/closed_loop"),
    first={"type": int, "default": 1, "help": "the first seed"},
    seeds={"type": int, "default": 1, "help": "how many"},
)
def main(chosen: Namespace) -> None:
    """Print the tables of the selected parts."""
    seeds = range(chosen.first, chosen.first + chosen.seeds)
    if chosen.part in ("named", "all"):
        named(chosen.out, seeds)
    if chosen.part in ("open", "all"):
        opened(chosen.out, seeds)
    (chosen.out / "done.json").write_text(json.dumps({"seeds": list(seeds)}))

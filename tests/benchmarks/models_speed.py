"""Print the computing times of the gripper's models."""

import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.models.answer_figures import Physics
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.motion_in_time import gripper_motion
from fingervision.models.parameter_sweep import parse_variation, sweep_answers
from fingervision.models.reference_mesh import ElementSize, mesh_outline
from fingervision.storage.gripper_toml import read_gripper
from tests.benchmarks.frame import Namespace, benchmark, spent_s

GRIPPER = Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml"
REPEATS = 3


def _command() -> None:
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, "-m", "fingervision", "model", str(GRIPPER), "--kind", "all", "--out", folder]
        subprocess.run(run, check=True, capture_output=True)


def _row(what: str, run: Callable[[], object]) -> None:
    clock, processor = spent_s(run, REPEATS)
    print(f"{clock:8.3f} s  {processor:8.3f} s  {what}", flush=True)


@benchmark()
def main(_: Namespace) -> None:
    """Print the median of three runs of each task: wall time and processor time in seconds."""
    gripper = read_gripper(GRIPPER)
    time_s = np.arange(0.0, 60.0, 0.04)
    inputs = np.interp(time_s, [0.0, 20.0, 40.0, 60.0], [0.0, 1.5, -0.4, 1.0])
    lumped = LumpedGripper(gripper)
    large = LumpedGripper(gripper, Physics(large_rotation=True, contact=True))
    _row("lumped, 60 s of drive at 25 Hz in motion (at most 0.1 s)",
         lambda: gripper_motion(lumped, DriveHistory(time_s, inputs)))  # fmt: skip
    _row("lumped, the same at rest, large rotation and contact", lambda: large.respond(inputs))
    _row("lumped, building", lambda: LumpedGripper(gripper))
    unknowns: list[int] = []

    def solve() -> None:
        mesh = mesh_outline(gripper, ElementSize(0.075, 1.3))
        model = FiniteElementGripper(gripper, mesh=mesh)
        model.respond(inputs)
        unknowns.append(model.plate.unknowns)

    _row("finite elements, mesh and plane stress (at most 1.5 s at 45 000 unknowns)", solve)
    print(f"  unknowns: {unknowns[-1]}")
    _row("finite elements, packaged mesh", lambda: FiniteElementGripper(gripper).respond(inputs))
    stroke = np.linspace(-2.0, 1.8, 101)
    for contact in (False, True):
        physics = Physics(large_rotation=True, contact=contact)
        _row(f"finite elements, large rotation from -2 to 1.8 mm{', with contact' * contact} (at most 3 s)",
             lambda physics=physics: FiniteElementGripper(gripper, physics).respond(stroke))  # fmt: skip
    variations = [parse_variation("hinge.thickness_mm=0.6:1.4:20"), parse_variation("lever.l2_mm=16:20:10")]
    _row("200 lumped variants (at most 5 s)", lambda: sweep_answers(gripper, variations, HingeTheory.CORRECTED))
    _row("model --kind all, the command (at most 4 s)", _command)

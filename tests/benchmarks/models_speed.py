"""Print the seconds of the gripper's models."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.lumped import LumpedGripper
from fingervision.models.mesh_outline import ElementSize, mesh_outline
from fingervision.models.motion_in_time import gripper_motion
from fingervision.models.physics import Physics
from fingervision.storage.gripper_toml import read_gripper

GRIPPER = Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml"
REPEATS = 5


def main() -> None:
    """Print the median of five runs of each: seconds on the clock, and of the processor (if others use it too)."""
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
        unknowns.append(model.half.unknowns)

    _row("finite elements, mesh and plane stress (at most 1.5 s at 45 000 unknowns)", solve)
    print(f"  unknowns: {unknowns[-1]}")
    _row("finite elements, packaged mesh", lambda: FiniteElementGripper(gripper).respond(inputs))


def _row(what: str, run: Callable[[], object]) -> None:
    seconds = []
    for _ in range(REPEATS):
        began = time.perf_counter(), time.process_time()
        run()
        seconds.append((time.perf_counter() - began[0], time.process_time() - began[1]))
    clock, processor = np.median(seconds, axis=0)
    print(f"{clock:8.3f} s  {processor:8.3f} s  {what}", flush=True)


if __name__ == "__main__":
    main()

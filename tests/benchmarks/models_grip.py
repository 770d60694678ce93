"""Compare the lumped gripper's gripping force and first mode with finite elements, for grippers with various hinges."""

from dataclasses import replace
from pathlib import Path

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.grip import Part, first_grip_mm, gripped
from fingervision.models.lumped import LumpedGripper
from fingervision.storage.gripper_toml import read_gripper
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.models_held_out import HELD_OUT, drawn

ROOT = Path(__file__).parents[2]
PART = Part(width_mm=2.0, stiffness_n_mm=50.0)
BEYOND_MM = 0.2
"""Input beyond the first touch of the part."""
JOINTS = (("finger_width_mm", 6.0), ("cross_bar_width_mm", 5.0), ("shuttle_width_mm", 7.0))


def cases(sample: Gripper) -> list[tuple[str, Gripper]]:
    """Yield the drawings of the held-out grippers, and of the published gripper with other hinges."""
    found = [(f"{row[0].name}, t {row[1]:g}, R {row[2]:g}, plate {row[3]:g}", drawn(sample, row)) for row in HELD_OUT]
    return found + [
        (f"sample, {name} = {value:g}", replace(sample, links=replace(sample.links, **{name: value})))
        for name, value in JOINTS
    ]


@benchmark()
def main(_: Namespace) -> None:
    """Print one line per drawing, with differences in %."""
    print("drawing | grip | first mode, drive held | stated: grip, mode")
    for name, gripper in cases(read_gripper(ROOT / "sample_frames" / "paper" / "gripper.toml")):
        grips, modes = [], []
        lumped = LumpedGripper(gripper)
        for model in (lumped, FiniteElementGripper(gripper)):
            first = first_grip_mm(model, PART) or 0.0
            grips.append(gripped(model, first - BEYOND_MM, PART).grip_n)
            modes.append(model.modes_hz(drive_held=True, count=1)[0])
        apart = [100.0 * (one / other - 1.0) for one, other in (grips, modes)]
        stated = lumped.figures()
        print(
            f"{name:44s} | {apart[0]:+6.2f} | {apart[1]:+6.2f} | {100.0 * stated.grip_error:.0f} "
            f"{100.0 * stated.mode_error:.0f}",
            flush=True,
        )

"""Effects simulated by mechanics: data come from a changed gripper, and the diagnosis has the unchanged drawing.

Run as `python -m tests.benchmarks.own_physics [--no-force]`. Each line shows one simulated change, the named effects,
and the disagreement before and after the correction.
"""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.gripper import Gripper
from fingervision.domain.report import DiagnosisReport
from fingervision.models.answer_figures import LINEAR, Physics
from fingervision.models.lumped import LumpedGripper
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.benchmarks.frame import Namespace, benchmark

Array = NDArray[np.float64]
Answer = tuple[Array, Array, Array]

DRAWING = Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml"
EDGE_MM = 0.001
FORCE_N = 0.01
RUN_MM = 0.0005
MIDLINE_MM = 0.3
RATE_HZ = 10.0
SEED = 5
CAMERA_ABOVE_MM = 100.0
"""Distance of the camera's centre of projection from the plate."""
OFF_PLANE_MM = 1.0
"""Distance of the drive force from the middle plane of the plate."""
LIFT_MM_PER_N_MM = 0.12956
"""Lift of the tips per moment of the drive force about x, with the drive guided in the plane and across it: the sample
as bars in three dimensions."""


def longer_lever(gripper: Gripper, by: float) -> Gripper:
    """Move hinge 1 and its pillar outwards by a share of the lever's length."""
    lever, links = gripper.lever, gripper.links
    by_mm = by * lever.l2_mm
    x0, x1, y0, y1 = links.pillar_and_root_mm
    return replace(
        gripper,
        lever=replace(lever, l2_mm=lever.l2_mm + by_mm, hinge1_mm=(lever.hinge1_mm[0] + by_mm, lever.hinge1_mm[1])),
        links=replace(links, pillar_and_root_mm=(x0 + by_mm, x1 + by_mm, y0, y1)),
    )


def halves(right: Gripper, left: Gripper, physics: Physics = LINEAR) -> Callable[[Array], Answer]:
    """Combine two different halves in parallel; each is computed as half of a symmetric gripper."""

    def run(input_mm: Array) -> Answer:
        a, b = (LumpedGripper(half, physics).respond(input_mm) for half in (right, left))
        assert a.force_n is not None
        assert b.force_n is not None
        return b.left_mm, a.right_mm, 0.5 * (a.force_n + b.force_n)

    return run


def lifted(gripper: Gripper) -> Callable[[Array], Answer]:
    """Apply the drive force off the middle plane: its moment lifts the tips towards a camera above, in three
    dimensions.
    """
    model = LumpedGripper(gripper)

    def run(input_mm: Array) -> Answer:
        answer = model.respond(input_mm)
        assert answer.force_n is not None
        z_mm = LIFT_MM_PER_N_MM * OFF_PLANE_MM * 0.5 * answer.force_n
        scale = CAMERA_ABOVE_MM / (CAMERA_ABOVE_MM - z_mm)
        return answer.left_mm * scale, answer.right_mm * scale, answer.force_n

    return run


@dataclass(frozen=True, slots=True)
class Hidden:
    """A change of the gripper that the drawing does not contain.

    Parameters
    ----------
    effect : str
        Name of the effect in the catalogue, or two names; empty for an unchanged gripper.
    words : str
        Description of the change.
    build : callable
        Function from the drawing to the measured gripper, which maps input to left, right and force.
    lowest_mm, highest_mm : float
        Range of inputs of the runs.
    """

    effect: str
    words: str
    build: Callable[[Gripper], Callable[[Array], Answer]]
    lowest_mm: float = -0.45
    highest_mm: float = 1.5


def _thinner(gripper: Gripper) -> Callable[[Array], Answer]:
    thin = replace(gripper, hinge=replace(gripper.hinge, thickness_mm=gripper.hinge.thickness_mm - 0.1))
    return halves(thin, thin)


def _softer(gripper: Gripper) -> Callable[[Array], Answer]:
    soft = replace(
        gripper, material=replace(gripper.material, youngs_modulus_mpa=0.9 * gripper.material.youngs_modulus_mpa)
    )
    return halves(soft, soft)


CASES = {
    "nothing": Hidden("", "nothing", lambda g: halves(g, g)),
    "link": Hidden("lever_ratio_error", "lever 1 % longer", lambda g: halves(*(longer_lever(g, 0.01),) * 2)),
    "short link": Hidden("lever_ratio_error", "lever 1 % shorter", lambda g: halves(*(longer_lever(g, -0.01),) * 2)),
    "contact": Hidden(
        "finger_contact", "fingers that touch", lambda g: halves(g, g, Physics(contact=True)), lowest_mm=-0.6
    ),
    "large rotation": Hidden(
        "large_deflection", "large rotation", lambda g: halves(g, g, Physics(large_rotation=True)), highest_mm=1.8
    ),
    "both": Hidden(
        "large_deflection, finger_contact",
        "large rotation, and fingers that touch",
        lambda g: halves(g, g, Physics(large_rotation=True, contact=True)),
        lowest_mm=-0.6,
        highest_mm=1.8,
    ),
    "right half": Hidden(
        "assembly_asymmetry", "right half's lever 1 % longer", lambda g: halves(longer_lever(g, 0.01), g)
    ),
    "left half": Hidden(
        "assembly_asymmetry", "left half's lever 1 % longer", lambda g: halves(g, longer_lever(g, 0.01))
    ),
    "hinges": Hidden("hinge_stiffness_error", "hinges 0.1 mm thinner", _thinner),
    "modulus": Hidden("hinge_stiffness_error", "modulus 10 % lower", _softer),
    "out of plane": Hidden("out_of_plane_motion", "drive off the middle plane", lifted),
}


def triangle(low: float, high: float, seconds: float) -> Array:
    """Input that increases and decreases at one speed."""
    up = np.linspace(low, high, round(seconds * RATE_HZ))
    return np.concatenate([up, up[-2::-1]])


def table(hidden: Hidden, folder: Path, *, force: bool, seed: int = SEED) -> Path:
    """Simulate four runs at two speeds, with holds and closing, and write the table."""
    rng = np.random.default_rng(seed)
    low, high = hidden.lowest_mm, hidden.highest_mm
    middle = 0.5 * (low + high)
    held = np.concatenate([np.linspace(low, high, 40), np.full(60, high), np.linspace(high, middle, 30),
                           np.full(40, middle)])  # fmt: skip
    runs = [triangle(low, high, 8.0), triangle(low, high, 2.5), held, triangle(high, low, 5.0)]
    measured = hidden.build(read_gripper(DRAWING))
    lines, clock = [], 0.0
    for index, u in enumerate(runs):
        time = clock + np.arange(u.size) / RATE_HZ
        clock = float(time[-1]) + 5.0
        left, right, pull = measured(u)
        shift = RUN_MM * rng.standard_normal(2)
        left = left + MIDLINE_MM + shift[0] + EDGE_MM * rng.standard_normal(u.size)
        right = right + MIDLINE_MM + shift[1] + EDGE_MM * rng.standard_normal(u.size)
        columns = [time, u, right - left, left, right]
        if force:
            columns.append(pull + FORCE_N * rng.standard_normal(u.size))
        lines += [f"run{index}," + ",".join(f"{x:.6f}" for x in row) for row in zip(*columns, strict=True)]
    path = folder / "measured.csv"
    header = "run,time_s,input_mm,gap_mm,left_mm,right_mm" + (",force_n" if force else "")
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return path


def answered(hidden: Hidden, folder: Path, *, force: bool, drawing: Path = DRAWING) -> DiagnosisReport:
    """Simulate a measurement, and diagnose the table with the unchanged drawing."""
    measured = read_measured_table(table(hidden, folder, force=force))
    return diagnose(measured, read_model(drawing), seed=SEED).report


@benchmark(no_force=False)
def main(chosen: Namespace) -> None:
    """Print the table of results."""
    for name, hidden in CASES.items():
        with tempfile.TemporaryDirectory() as folder:
            report = answered(hidden, Path(folder), force=not chosen.no_force)
        d = report.disagreement
        found = " | ".join("+".join(names) for names in report.alternatives) or "-"
        print(f"{name:15} {report.verdict:10} {found:50} {1e3 * d.before_rms_mm:8.1f} -> {1e3 * d.after_rms_mm:.2f} um"
              f"   {report.seconds:.1f} s")  # fmt: skip
        for effect in report.effects:
            numbers = (f"{key} = {e.value:.5g} +- {e.u or 0.0:.2g}" for key, e in effect.parameters.items())
            print(f"{'':16}{effect.name}: {', '.join(numbers)}")

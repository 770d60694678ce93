"""Print the errors of all kinds of model for grippers to which nothing was fitted: slope, force, stress and modes."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Material
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.gripper_mechanism import redrawn
from fingervision.models.lumped import LumpedGripper
from fingervision.models.reference_mesh import ElementSize, mesh_outline
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper
from fingervision.storage.gripper_toml import read_gripper
from tests.benchmarks.frame import Namespace, benchmark

ROOT = Path(__file__).parents[2]
PA2200 = Material("PA2200", 1650.0, 0.34, 930.0, 48.0)
ALUMINIUM = Material("aluminium 7075-T6", 71700.0, 0.33, 2810.0, 503.0)
ABS = Material("ABS", 2200.0, 0.35, 1040.0, 40.0)
TITANIUM = Material("Ti-6Al-4V", 113800.0, 0.342, 4430.0, 880.0)
STEEL = Material("spring steel", 210000.0, 0.3, 7850.0, 1200.0)
SILICON = Material("silicon", 169000.0, 0.28, 2330.0, 1000.0)
# Columns: material, hinge thickness, radius, plate thickness, increase of l2, increase of l3 (mm).
HELD_OUT = (
    (PA2200, 1.0, 4.0, 3.0, 0.0, 0.0),
    (ALUMINIUM, 0.05, 4.0, 1.0, 0.0, 0.0),
    (STEEL, 0.1, 5.0, 2.0, 0.0, 0.0),
    (ABS, 1.5, 5.0, 6.0, 4.0, 0.0),
    (TITANIUM, 0.5, 4.0, 6.0, -3.0, 0.0),
    (SILICON, 0.2, 8.0, 1.0, 0.0, 0.0),
    (ABS, 2.0, 5.0, 20.0, 0.0, 0.0),
    (ALUMINIUM, 1.0, 6.0, 10.0, 8.0, 2.0),
    (STEEL, 0.3, 4.5, 6.0, -6.0, -2.0),
)
REFINED = 0.5
"""Edge lengths of the reference mesh over those of the model; the reference force of the published gripper is within
0.005 % of its limit."""


def drawn(gripper: Gripper, row: tuple[Material, float, float, float, float, float]) -> Gripper:
    """Change the drawing of the published gripper."""
    material, thickness_mm, radius_mm, plate_mm, l2_by, l3_by = row
    gripper = replace(
        gripper,
        material=material,
        hinge=replace(gripper.hinge, thickness_mm=thickness_mm, radius_mm=radius_mm),
        body=replace(gripper.body, plate_mm=plate_mm),
    )
    for name, by in (("lever.l2_mm", l2_by), ("lever.l3_mm", l3_by)):
        gripper = redrawn(gripper, name, by) if by else gripper
    return gripper


def drawn_at_random(count: int, seed: int) -> list[tuple[Material, float, float, float, float, float]]:
    """Draw random rows for `HELD_OUT`: t / R from 0.0125 to 0.4, width over thickness 1 to 20, plates of 1 to 20 mm."""
    generator = np.random.default_rng(seed)
    materials = (PA2200, ALUMINIUM, ABS, TITANIUM, STEEL, SILICON)
    found = []
    for _ in range(count):
        radius_mm = float(generator.uniform(4.3, 8.0))
        thickness_mm = radius_mm * float(np.exp(generator.uniform(np.log(0.0125), np.log(0.4))))
        wide = float(np.exp(generator.uniform(0.0, np.log(20.0))))
        row = (round(thickness_mm, 3), round(radius_mm, 2), round(float(np.clip(wide * thickness_mm, 1.0, 20.0)), 2))
        longer = tuple(round(float(generator.uniform(*ends)), 2) for ends in ((-6.0, 8.0), (-2.0, 2.0)))
        found.append((materials[generator.integers(len(materials))], *row, *longer))
    return found


@benchmark(
    seed={"type": int, "help": "draw others at random; the fixed ones without"},
    count={"type": int, "default": 6, "help": "how many with --seed"},
)
def main(asked: Namespace) -> None:
    """Print errors in % against the plane model with a mesh twice as fine; its force and modes include the width
    effect.
    """
    rows = HELD_OUT if asked.seed is None else tuple(drawn_at_random(asked.count, asked.seed))
    sample = read_gripper(ROOT / "sample_frames" / "paper" / "gripper.toml")
    print(
        "material, t, R, plate | finite_element: slope force stress mode (drive free, held) | lumped: same | "
        "matrix: slope"
    )
    for row in rows:
        began = time.perf_counter()
        gripper = drawn(sample, row)
        fine = REFINED * 0.2 * gripper.hinge.thickness_mm
        try:
            mesh = mesh_outline(gripper, ElementSize(fine, REFINED * 2.5))
        except DataError as error:  # in some random drawings, a notch lies outside the bodies
            print(f"{row[0].name:18s} {row[1]:6.3f} {row[2]:4.2f} {row[3]:5.2f} | {error}", flush=True)
            continue
        reference = FiniteElementGripper(gripper, mesh=mesh)
        model, lumped = FiniteElementGripper(gripper), LumpedGripper(gripper)
        cells = []
        for other in (model, lumped):
            pairs = (
                (other.gap_per_input, reference.gap_per_input),
                (other.force_per_input_n_mm, reference.force_per_input_n_mm),
                (other.peak_stress().mpa_per_mm, reference.peak_stress().mpa_per_mm),
                (other.modes_hz(drive_held=False)[0], reference.modes_hz(drive_held=False)[0]),
                (other.modes_hz(drive_held=True)[0], reference.modes_hz(drive_held=True)[0]),
            )
            cells.append(" ".join(f"{100.0 * (a / b - 1.0):+7.3f}" for a, b in pairs))
        matrix = 100.0 * (StiffnessMatrixGripper(gripper).gap_per_input / reference.gap_per_input - 1.0)
        print(
            f"{row[0].name:18s} {row[1]:6.3f} {row[2]:4.2f} {row[3]:5.2f} | {' | '.join(cells)} | {matrix:+7.3f} | "
            f"{model.plate.unknowns} unknowns, quality {model.mesh.quality().min():.2f}, "
            f"{time.perf_counter() - began:.0f} s",
            flush=True,
        )

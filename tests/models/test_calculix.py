"""CalculiX, an independent program, computes the same outline in three dimensions."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.reference_mesh import PlaneMesh
from tests.benchmarks.solid_reference import solid_answer

pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (Debian package calculix-ccx) is absent")

# Tolerances of plane stress against three dimensions: anticlastic bending stiffens the hinges by 3 %; the slope depends
# on geometry only.
SLOPE = 1e-3
FORCE = 0.04
LAYERS = 1
ON_MM = 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("input_mm", "large"), [(1.0, False), (1.8, True)])
def test_three_dimensions_agree(
    gripper: Gripper, finite_element: FiniteElementGripper, input_mm: float, large: bool
) -> None:
    with np.load(Path(__file__).parent / "coarse_mesh.npz") as stored:
        mesh = PlaneMesh(stored["nodes_mm"], stored["triangles"].astype(np.int64))
    inner = mesh.nodes_mm[:, np.abs(mesh.nodes_mm[0] - gripper.tip_corner_mm[0]) < ON_MM]
    top = sorted(inner[1].tolist())[-3:]
    probes = {f"{y}": (gripper.tip_corner_mm[0], y) for y in top}
    half = replace(half_mechanism(gripper), mirrored=False, probes=probes, pairs={})
    solid = solid_answer(half, mesh, layers=LAYERS, modes=(), input_mm=input_mm, large=large)
    across = [solid.probes_mm[name][0] for name in probes]
    moved = float(np.polyval(np.polyfit(top, across, 2), gripper.measuring_point_mm[1]))
    ours = finite_element.elastic.state(input_mm, large_rotation=large)
    slope = (ours.pairs_mm["gap"] - finite_element.rest_gap_mm) / input_mm
    assert 2.0 * moved / input_mm == pytest.approx(slope, rel=SLOPE)
    assert 2.0 * solid.force_n == pytest.approx(ours.force_n, rel=FORCE)

"""CalculiX, an independent program, computes the same outline in three dimensions."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.reference_mesh import PlaneMesh

pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (Debian package calculix-ccx) is absent")

# Tolerances of plane stress against three dimensions: anticlastic bending stiffens the hinges by 3 %; the slope depends
# on geometry only.
SLOPE = 1e-3
FORCE = 0.04
LAYERS = 2
ON_MM = 1e-6


class Extruded:
    """Ten-node tetrahedra through the plate's thickness: each prism is divided into three, in the same way on shared
    faces.
    """

    def __init__(self, mesh: PlaneMesh, plate_mm: float) -> None:
        self.plane, self.plate_mm = mesh, plate_mm
        middle = {}
        for a, b, c, ab, bc, ac in mesh.triangles.T.tolist():
            middle |= {frozenset((a, b)): ab, frozenset((b, c)): bc, frozenset((a, c)): ac}
        self.places: dict[tuple[int, int], int] = {}
        self.nodes: list[tuple[float, float, float]] = []
        self.elements: list[list[int]] = []
        for triangle in mesh.triangles[:3].T.tolist():
            for layer in range(LAYERS):
                prism = [(node, 2 * layer + 2 * up) for up in (0, 1) for node in sorted(triangle)]
                for four in ((0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3)):
                    self._tetrahedron([prism[i] for i in four], middle)

    def _tetrahedron(self, corners: list[tuple[int, int]], middle: dict[frozenset[int], int]) -> None:
        points = np.array([self.nodes[self._node(*corner)] for corner in corners])
        if np.linalg.det(points[1:] - points[0]) < 0.0:
            corners[0], corners[1] = corners[1], corners[0]
        edges = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
        halves = []
        for i, j in edges:
            (a, low), (b, high) = corners[i], corners[j]
            halves.append(self._node(a if a == b else middle[frozenset((a, b))], (low + high) // 2))
        self.elements.append([self._node(*corner) for corner in corners] + halves)

    def _node(self, plane: int, level: int) -> int:
        if (plane, level) not in self.places:
            self.places[plane, level] = len(self.nodes)
            x, y = self.plane.nodes_mm[:, plane]
            self.nodes.append((x, y, self.plate_mm * level / (2 * LAYERS)))
        return self.places[plane, level]


def run_calculix(
    folder: Path, gripper: Gripper, body: Extruded, input_mm: float, *, large: bool
) -> tuple[dict[int, float], float]:
    """Displacement across the symmetry plane by node, and the force at the drive of both halves."""
    nodes = np.array(body.nodes)
    x, y = nodes[:, 0], nodes[:, 1]
    clamp = np.flatnonzero((np.abs(y) < ON_MM) & (x > gripper.links.pillar_and_root_mm[0] - ON_MM)) + 1
    axis = np.flatnonzero(np.abs(x) < ON_MM) + 1
    drive = np.flatnonzero((np.abs(y - gripper.lever.drive_face_y_mm) < ON_MM) & (x < 7.0 + ON_MM)) + 1
    face = np.flatnonzero((np.abs(x - 2.0) < ON_MM) & (y > 92.0 - ON_MM)) + 1
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i},{a:.12g},{b:.12g},{c:.12g}" for i, (a, b, c) in enumerate(body.nodes, 1)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=BODY")
    lines += [f"{i}," + ",".join(str(node + 1) for node in element) for i, element in enumerate(body.elements, 1)]
    for name, members in (("CLAMP", clamp), ("AXIS", axis), ("DRIVE", drive), ("FACE", face)):
        lines += [f"*NSET, NSET={name}", *(f"{node}," for node in members)]
    material = gripper.material
    lines += ["*MATERIAL, NAME=PA", "*ELASTIC", f"{material.youngs_modulus_mpa},{material.poisson_ratio}"]
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=PA", "*BOUNDARY", "CLAMP,1,3", "AXIS,1,1"]
    lines += [f"*STEP{', NLGEOM' if large else ''}", "*STATIC", "0.5,1." if large else "1.,1."]
    lines += ["*BOUNDARY", f"DRIVE,2,2,{input_mm}", "*NODE PRINT, NSET=FACE, FREQUENCY=100", "U"]
    lines += ["*NODE PRINT, NSET=DRIVE, TOTALS=ONLY, FREQUENCY=100", "RF", "*END STEP"]
    (folder / "half.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["ccx", "half"], cwd=folder, check=True, capture_output=True, timeout=140)
    across: dict[int, float] = {}
    force_n = 0.0
    for line in (folder / "half.dat").read_text().splitlines():
        cells = line.split()
        if len(cells) == 4 and cells[0].isdigit():
            across[int(cells[0]) - 1] = float(cells[1])
        elif len(cells) == 3 and not cells[0].isalpha():
            force_n = 2.0 * float(cells[1])
    return across, force_n


@pytest.fixture(scope="module")
def coarse() -> PlaneMesh:
    with np.load(Path(__file__).parent / "coarse_mesh.npz") as stored:
        return PlaneMesh(stored["nodes_mm"], stored["triangles"].astype(np.int64))


@pytest.mark.slow
@pytest.mark.parametrize(("input_mm", "large"), [(1.0, False), (1.8, True)])
def test_three_dimensions_agree(
    tmp_path: Path,
    gripper: Gripper,
    finite_element: FiniteElementGripper,
    coarse: PlaneMesh,
    input_mm: float,
    large: bool,
) -> None:
    body = Extruded(coarse, gripper.body.plate_mm)
    across, force_n = run_calculix(tmp_path, gripper, body, input_mm, large=large)
    heights = {body.nodes[node][1]: value for node, value in across.items() if body.nodes[node][2] == 1.5}
    top = sorted(heights)[-3:]
    moved = float(np.polyval(np.polyfit(top, [heights[y] for y in top], 2), 99.7))
    ours = finite_element.elastic.state(input_mm, large_rotation=large)
    slope = (ours.pairs_mm["gap"] - finite_element.rest_gap_mm) / input_mm
    assert 2.0 * moved / input_mm == pytest.approx(slope, rel=SLOPE)
    assert force_n == pytest.approx(ours.force_n, rel=FORCE)

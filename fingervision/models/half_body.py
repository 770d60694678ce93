"""One half of the gripper as an elastic body: what is clamped, guided and driven, and where the gap is measured.

The lower face of the pillar is clamped, the symmetry axis cannot move across itself, the drive face moves by the input.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import SuperLU, splu

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper
from fingervision.models.mesh_outline import PlaneMesh
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

ON_MM = 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class Equilibrium:
    """The body at one input.

    Parameters
    ----------
    input_mm : float
        Displacement of the drive.
    displacement_mm : ndarray of float, shape (unknowns,)
        Displacement components.
    force_n : float
        Force at the drive, both halves.
    contact_n : ndarray of float, shape (face nodes,)
        Force of the symmetry plane on each node of the tip's inner face.
    """

    input_mm: float
    displacement_mm: Array
    force_n: float
    contact_n: Array


class HalfBody:
    """The right half with its supports.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    mesh : PlaneMesh
        Triangles of the right half.

    Raises
    ------
    FingervisionError
        Where the mesh has no node on the clamp, the axis, the drive face or the tip's inner face.
    """

    def __init__(self, gripper: Gripper, mesh: PlaneMesh) -> None:
        self.gripper = gripper
        self.plate = PlaneStressPlate(mesh, gripper.material, gripper.body.plate_mm)
        plate, links, lever = self.plate, gripper.links, gripper.lever
        x, y = plate.nodes_mm
        clamped = np.abs(y - links.pillar_and_root_mm[2]) < ON_MM
        clamped &= (x >= links.pillar_and_root_mm[0] - ON_MM) & (x <= links.pillar_and_root_mm[1] + ON_MM)
        axis = np.abs(x) < ON_MM
        driven = (np.abs(y - lever.drive_face_y_mm) < ON_MM) & (x <= lever.drive_face_half_width_mm + ON_MM)
        for name, nodes in (("lower face of the pillar", clamped), ("symmetry axis", axis), ("drive face", driven)):
            if not nodes.any():
                raise FingervisionError(f"The body must reach the {name}, but has no material there; check the links.")
        self.driven: Indices = plate.y_dofs[driven]
        self._held: Indices = np.unique(np.concatenate([plate.x_dofs[clamped | axis], plate.y_dofs[clamped]]))
        self.face, self._face_edges = self._inner_face()

    def _inner_face(self) -> tuple[Indices, Indices]:
        """Nodes of the tip's inner face, and its edges (two ends and the middle)."""
        x, y = self.plate.nodes_mm
        corner, heel = self.gripper.tip_corner_mm, self.gripper.tip_heel_mm
        edges = self.plate.outline_edges
        on_face = np.all(np.abs(x[edges] - corner[0]) < ON_MM, axis=0) & np.all(y[edges] >= heel[1] - ON_MM, axis=0)
        if not on_face.any():
            raise FingervisionError(
                "The tip's inner face must be an upright edge of the outline, but the body hides it."
            )
        edges = edges[:, on_face]
        return np.unique(edges), edges

    def measuring_point_x_mm(self, displacement_mm: Array) -> float:
        """Distance of the measuring point from the symmetry plane: quadratic between the nodes of its edge."""
        x_mm, y_mm = self.gripper.measuring_point_mm
        return float(x_mm + self._weights @ displacement_mm[self.plate.x_dofs[self._weighed]])

    @cached_property
    def _weighed(self) -> Indices:
        y = self.plate.nodes_mm[1]
        y_mm = self.gripper.measuring_point_mm[1]
        ends = np.sort(y[self._face_edges[:2]], axis=0)
        place = int(np.argmax((ends[0] <= y_mm + ON_MM) & (ends[1] >= y_mm - ON_MM)))
        return self._face_edges[:, place]

    @cached_property
    def _weights(self) -> Array:
        a, b, _ = self.plate.nodes_mm[1, self._weighed]
        s = (self.gripper.measuring_point_mm[1] - a) / (b - a)
        return np.array([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)])

    @cached_property
    def free(self) -> Indices:
        """Unknowns that neither the clamp, the axis nor the drive holds."""
        return np.setdiff1d(np.arange(self.plate.unknowns), np.concatenate([self._held, self.driven]))

    @cached_property
    def _solver(self) -> SuperLU:
        return splu(self.plate.stiffness_n_mm[self.free][:, self.free].tocsc())

    @cached_property
    def unit_displacement_mm(self) -> Array:
        """Small displacements of the whole body by 1 mm of input."""
        moved = np.zeros(self.plate.unknowns)
        moved[self.driven] = 1.0
        moved[self.free] = self._solver.solve(-(self.plate.stiffness_n_mm @ moved)[self.free])
        return moved

    @cached_property
    def face_compliance(self) -> tuple[Array, Array]:
        """Displacements of the body by a unit force on each face node, and their components on the face."""
        dofs = self.plate.x_dofs[self.face]
        loads = np.zeros((self.plate.unknowns, dofs.size))
        loads[dofs, np.arange(dofs.size)] = 1.0
        moved = np.zeros_like(loads)
        moved[self.free] = self._solver.solve(np.ascontiguousarray(loads[self.free]))
        compliance = moved[dofs]
        return moved, 0.5 * (compliance + compliance.T)

    def resting(self) -> Equilibrium:
        """The undeformed body."""
        return Equilibrium(0.0, np.zeros(self.plate.unknowns), 0.0, np.zeros(self.face.size))

    def face_gap_mm(self, displacement_mm: Array) -> Array:
        """Distance of each node of the inner face from the symmetry plane."""
        return np.asarray(self.plate.nodes_mm[0, self.face] + displacement_mm[self.plate.x_dofs[self.face]])

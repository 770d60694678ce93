"""Frame structure of the half gripper: pillar, hinges and shuttle as beam elements, the finger as one elastic body."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

from fingervision.models.corotational_frame import CorotationalFrame
from fingervision.models.finger_body import FingerBody

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class JoinedFrame:
    """Beam elements and one elastic body that share the nodes of a tree; large rotations, small strains.

    Parameters
    ----------
    nodes_mm : ndarray of float, shape (n, 2)
        Positions of all nodes of the tree.
    ends : ndarray of int, shape (m, 2)
        Node indices of the two ends of all members, including those within the body.
    places : ndarray of int
        Indices of the members that are beam elements.
    elements : CorotationalFrame
        The beam elements.
    body : FingerBody
        The elastic body that replaces the other members.
    """

    nodes_mm: Array
    ends: Indices
    places: Indices
    elements: CorotationalFrame
    body: FingerBody

    @property
    def unknowns(self) -> int:
        """Number of unknowns: three per node."""
        return self.elements.unknowns

    @cached_property
    def _entries(self) -> tuple[Indices, Indices]:
        dofs = self.body.unknowns
        return np.repeat(dofs, dofs.size), np.tile(dofs, dofs.size)

    def internal_force_n(self, displacement: Array) -> tuple[csr_matrix, Array]:
        """Tangent stiffness and nodal forces, as in `CorotationalFrame.internal_force_n`."""
        tangent, force = self.elements.internal_force_n(displacement)
        dofs = self.body.unknowns
        stiffness, loads = self.body.turning.forces_n(displacement[dofs])
        force[dofs] += loads
        return csr_matrix(tangent + coo_matrix((stiffness.ravel(), self._entries), shape=tangent.shape)), force

    def end_loads(self, displacement: Array) -> Array:
        """Tension in N and moments in N mm at both ends of every member, shape (m, 3); 0 within the body."""
        loads = np.zeros((len(self.ends), 3))
        loads[self.places] = self.elements.end_loads(displacement)
        return loads

    def stiffness_n_mm(self) -> csr_matrix:
        """Linear stiffness in the undeformed shape."""
        return self.internal_force_n(np.zeros(self.unknowns))[0]

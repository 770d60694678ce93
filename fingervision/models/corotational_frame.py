"""A plane frame of two-node corotational elements: large rotations, small strains.

Each element has a linear law that gives its forces from its elongation and from the rotations of its ends relative to
its chord; the chord may rotate by any angle. Source: Crisfield, Non-linear Finite Element Analysis of Solids and
Structures, volume 1, section 7.3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CorotationalFrame:
    """A plane frame structure: nodes with displacements x, y and rotation, and the elements between them.

    Parameters
    ----------
    nodes_mm : ndarray of float, shape (n, 2)
        Positions of the nodes at rest; unknowns are ordered x, y, rotation, node by node.
    ends : ndarray of int, shape (m, 2)
        Indices of the two nodes of each element.
    end_compliance : ndarray of float, shape (m, 3, 3)
        Compliance of each element at its second node with the first node fixed: along the element, across it, rotation.
    """

    nodes_mm: Array
    ends: Indices
    end_compliance: Array

    def __post_init__(self) -> None:
        chord = self.nodes_mm[self.ends[:, 1]] - self.nodes_mm[self.ends[:, 0]]
        length = np.hypot(chord[:, 0], chord[:, 1])
        # Elongation and end rotations relative to the chord, in the axes of the first node.
        natural = np.zeros((len(length), 3, 3))
        natural[:, 0, 0] = 1.0
        natural[:, 1, 1] = -length
        natural[:, 2, 1] = -1.0
        natural[:, 2, 2] = 1.0
        stiffness = np.linalg.inv(self.end_compliance)
        dofs = (3 * self.ends[:, :, None] + np.arange(3)).reshape(-1, 6)
        object.__setattr__(self, "_length", length)
        object.__setattr__(self, "_natural", np.swapaxes(natural, 1, 2) @ stiffness @ natural)
        object.__setattr__(self, "_dofs", dofs)

    _length: Array = None  # type: ignore[assignment]
    _natural: Array = None  # type: ignore[assignment]
    _dofs: Indices = None  # type: ignore[assignment]

    @property
    def unknowns(self) -> int:
        """Number of unknowns: three per node."""
        return 3 * len(self.nodes_mm)

    def internal_force_n(self, displacement: Array) -> tuple[csr_matrix, Array]:
        """Tangent stiffness and nodal forces of the deformed frame.

        Parameters
        ----------
        displacement : ndarray of float, shape (unknowns,)
            Displacements in mm and rotations in rad.
        """
        natural, c, s, length = self._deformation(displacement)
        forces = np.einsum("mij,mj->mi", self._natural, natural)
        zero = np.zeros_like(c)
        r = np.stack([-c, -s, zero, c, s, zero], axis=1)
        z = np.stack([s, -c, zero, -s, c, zero], axis=1)
        B = np.stack([r, -z / length[:, None], -z / length[:, None]], axis=1)
        B[:, 1, 2] += 1.0
        B[:, 2, 5] += 1.0
        element_force = np.einsum("mij,mi->mj", B, forces)
        tangent = np.swapaxes(B, 1, 2) @ self._natural @ B
        tangent += (forces[:, 0] / length)[:, None, None] * z[:, :, None] * z[:, None, :]
        moment = (forces[:, 1] + forces[:, 2]) / length**2
        tangent += moment[:, None, None] * (r[:, :, None] * z[:, None, :] + z[:, :, None] * r[:, None, :])
        return self._assembled(tangent), np.asarray(
            np.bincount(self._dofs.ravel(), element_force.ravel(), self.unknowns), dtype=np.float64
        )

    def end_loads(self, displacement: Array) -> Array:
        """Tension in N and moments in N mm at both ends of every element in the deformed shape, shape (m, 3)."""
        return np.asarray(np.einsum("mij,mj->mi", self._natural, self._deformation(displacement)[0]))

    def _deformation(self, displacement: Array) -> tuple[Array, Array, Array, Array]:
        """Elongation and end rotations relative to the chord, shape (m, 3), with the chord's cosine, sine, length."""
        local = displacement[self._dofs]
        at_rest = self.nodes_mm[self.ends[:, 1]] - self.nodes_mm[self.ends[:, 0]]
        drift = local[:, 3:5] - local[:, 0:2]
        chord = at_rest + drift
        length = np.hypot(chord[:, 0], chord[:, 1])
        c, s = chord[:, 0] / length, chord[:, 1] / length
        # Rotation of the chord from its direction at rest. The elongation below is computed from a difference of
        # squares, so that small motions lose no digits.
        across = at_rest[:, 0] * drift[:, 1] - at_rest[:, 1] * drift[:, 0]
        turned = np.arctan2(across, np.sum(at_rest * chord, axis=1))
        natural = np.empty((len(length), 3))
        natural[:, 0] = np.sum((2.0 * at_rest + drift) * drift, axis=1) / (length + self._length)
        for column, rotation in ((1, local[:, 2]), (2, local[:, 5])):
            apart = rotation - turned
            natural[:, column] = apart - 2.0 * np.pi * np.round(apart / (2.0 * np.pi))
        return natural, c, s, length

    def stiffness_n_mm(self) -> csr_matrix:
        """Linear stiffness in the undeformed shape."""
        return self.internal_force_n(np.zeros(self.unknowns))[0]

    def _assembled(self, element: Array) -> csr_matrix:
        rows = np.repeat(self._dofs, 6, axis=1)
        columns = np.tile(self._dofs, (1, 6))
        matrix = coo_matrix((element.ravel(), (rows.ravel(), columns.ravel())), shape=(self.unknowns, self.unknowns))
        return csr_matrix(matrix)

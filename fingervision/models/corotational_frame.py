"""A plane frame of two-node corotational elements: large rotations, small strains.

Each element has a linear law that gives its forces from its elongation and from the rotations of its ends relative to
its chord; the chord may rotate by any angle. Source: Crisfield, Non-linear Finite Element Analysis of Solids and
Structures, volume 1, section 7.3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

# A condensed body in large rotation: linear elasticity in axes that rotate with its first coordinate frame.
#
# The method is the corotational formulation of Crisfield (Non-linear Finite Element Analysis of Solids and Structures,
# volume 1, section 7.3), for an element with any number of nodes: the energy is d' K d / 2, with K the stiffness
# matrix and d the motions of the coordinate frames relative to the first one. Each coordinate frame is a connection
# point of the body, with two displacements and a rotation.

Array = NDArray[np.float64]

_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def turned_axes(angle: float) -> Array:
    """Matrix of a rotation, shape (2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def frame_axes(c: float, s: float) -> Array:
    """Turn motions (x, y, rotation) from axes in the direction (c, s) to global axes; shape (3, 3)."""
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def carried(arm: Array) -> Array:
    """Matrix that gives the motion at the end of an arm from that at its start; its transpose transfers loads back."""
    return np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class CorotationalBody:
    """One condensed body in large rotation.

    Parameters
    ----------
    places_mm : ndarray of float, shape (m, 2)
        Positions of the body's frames at rest.
    stiffness_n_mm : ndarray of float, shape (3 m, 3 m)
        Stiffness for small motions of the frames; rigid motions cause no force.
    """

    places_mm: Array
    stiffness_n_mm: Array

    def strained(self, moved: Array) -> Array:
        """Motions of the coordinate frames relative to the first one, shape (3 m,), from their absolute motions."""
        local = moved.reshape(-1, 3)
        at_rest = self.places_mm - self.places_mm[0]
        drift = local[:, :2] - local[0, :2]
        # R' (X + drift) - X is computed without subtracting large numbers: (R' - 1) X follows from the half angle.
        angle = local[0, 2]
        back = turned_axes(-angle)
        half = np.sin(0.5 * angle)
        less = 2.0 * half * (-half * np.eye(2) - np.cos(0.5 * angle) * _TURN)
        apart = local[:, 2] - angle
        return np.column_stack([drift @ back.T + at_rest @ less.T, apart]).ravel()

    def slope(self, moved: Array) -> Array:
        """Derivative of `strained` with respect to the frames' motions, shape (3 m, 3 m)."""
        local = moved.reshape(-1, 3)
        back = turned_axes(-float(local[0, 2]))
        chord = self.places_mm - self.places_mm[0] + local[:, :2] - local[0, :2]
        count = len(local)
        found = np.zeros((count, 3, count, 3))
        every = np.arange(1, count)
        found[every, :2, every, :2] = back
        found[every, 2, every, 2] = 1.0
        found[1:, :2, 0, :2] = -back
        found[1:, :2, 0, 2] = chord[1:] @ (-_TURN @ back).T
        found[1:, 2, 0, 2] = -1.0
        return found.reshape(local.size, local.size)

    def forces_n(self, moved: Array) -> tuple[Array, Array]:
        """Tangent stiffness, shape (3 m, 3 m), and forces, shape (3 m,), for given motions of the coordinate frames."""
        local = moved.reshape(-1, 3)
        loads = self.stiffness_n_mm @ self.strained(moved)
        slope = self.slope(moved)
        back = turned_axes(-float(local[0, 2]))
        chord = self.places_mm - self.places_mm[0] + local[:, :2] - local[0, :2]
        pulls = loads.reshape(-1, 3)[1:, :2]
        pulled = pulls @ (-_TURN @ back)
        by_turn = np.zeros((len(local), 3))
        by_turn[1:, :2] = pulled
        by_turn[0, :2] = -pulled.sum(axis=0)
        bent = np.zeros_like(slope)
        bent[:, 2] += by_turn.ravel()
        bent[2, :] += by_turn.ravel()
        bent[2, 2] -= float(np.sum(pulls * (chord[1:] @ back.T)))
        return slope.T @ self.stiffness_n_mm @ slope + bent, slope.T @ loads


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

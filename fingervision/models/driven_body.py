"""An elastic half gripper with supports and drive: its small displacements, contact and vibration modes."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh, splu

from fingervision.models.signorini import contact_forces_n

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_DENSE_BELOW = 400


def factorised(matrix: csr_matrix) -> SuperLU:
    """Factorise a symmetric matrix with an ordering and pivoting that is a sixth faster than SuperLU's default."""
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


@dataclass(frozen=True, slots=True, eq=False)
class Equilibrium:
    """State of the body at one input.

    Parameters
    ----------
    input_mm : float
        Displacement of the drive.
    displacement_mm : ndarray of float, shape (unknowns,)
        Displacement components (and rotations, where the model has them).
    force_n : float
        Force at the drive, both halves.
    contact_n : ndarray of float, shape (face points,)
        Force of the symmetry plane on each point of the tip's inner face.
    """

    input_mm: float
    displacement_mm: Array
    force_n: float
    contact_n: Array


@dataclass(frozen=True, eq=False)
class DrivenBody:
    """The right half of a gripper with its supports; the whole gripper consists of two halves in parallel.

    Parameters
    ----------
    stiffness_n_mm : sparse matrix, shape (unknowns, unknowns)
        Stiffness matrix for small motions.
    assemble_mass : callable
        Returns the mass matrix in tonnes; called when it is first needed, because static results do not need it.
    tangent : callable
        Maps displacements to the tangent stiffness and the internal forces in the deformed shape.
    driven, free : ndarray of int
        Indices of the unknowns that move by the input, and of those that are free; all others are fixed.
    swaying : ndarray of int
        Indices of the unknowns that are free while both halves and the drive move the same way sideways (antisymmetric
        modes): points on the symmetry axis then cannot move along the axis, and the actuator does not guide the drive
        sideways.
    face, face_rest_mm : ndarray
        Unknowns (perpendicular to the symmetry plane) of the points that may touch that plane, and the points'
        distances from the plane at rest.
    measured, weights : ndarray
        Unknowns and weights whose weighted sum is the motion of the measuring point perpendicular to the symmetry
        plane.
    measured_rest_mm : float
        Distance of the measuring point from the symmetry plane at rest.
    nodes : ndarray of int, shape (nodes, 2)
        Indices of the unknowns along x and y of every node.
    nodes_mm : ndarray of float, shape (nodes, 2)
        Positions of the nodes at rest.
    nodal_force : callable or None
        Maps displacements to internal forces without the tangent, where that is faster.
    """

    stiffness_n_mm: csr_matrix
    assemble_mass: Callable[[], csr_matrix]
    tangent: Callable[[Array], tuple[csr_matrix, Array]]
    driven: Indices
    free: Indices
    swaying: Indices
    face: Indices
    face_rest_mm: Array
    measured: Indices
    weights: Array
    measured_rest_mm: float
    nodes: Indices
    nodes_mm: Array
    nodal_force: Callable[[Array], Array] | None = None

    def internal_force_n(self, displacement: Array) -> Array:
        """Internal forces in the deformed shape, computed without the tangent matrix where that is possible."""
        return self.tangent(displacement)[1] if self.nodal_force is None else self.nodal_force(displacement)

    @cached_property
    def paths(self) -> dict[tuple[float, float, bool, int], list[Equilibrium]]:
        """Cache of equilibria in the deformed shape, by first input, last input, contact and number of steps."""
        return {}

    @cached_property
    def touches(self) -> dict[float, Equilibrium]:
        """Cache of the drive displacements at which the fingers first touch; the key is the initial estimate."""
        return {}

    @property
    def unknowns(self) -> int:
        """Number of displacement components."""
        return int(self.stiffness_n_mm.shape[0])

    @cached_property
    def mass_t(self) -> csr_matrix:
        """Mass matrix in tonnes."""
        return self.assemble_mass()

    @cached_property
    def _solver(self) -> SuperLU:
        return factorised(self.stiffness_n_mm[self.free][:, self.free])

    def solve_free(self, load_n: Array) -> Array:
        """Small displacements of the free unknowns under a load on them, with the drive fixed."""
        return np.asarray(self._solver.solve(load_n))

    @cached_property
    def unit_displacement_mm(self) -> Array:
        """Small displacements of the whole body per 1 mm of input."""
        moved = np.zeros(self.unknowns)
        moved[self.driven] = 1.0
        moved[self.free] = self._solver.solve(-(self.stiffness_n_mm @ moved)[self.free])
        return moved

    @cached_property
    def face_displacement_mm(self) -> Array:
        """Small displacements of the body with fixed drive under a unit force on one face point, for each face point.

        Each column of the returned array belongs to one face point.
        """
        loads = np.zeros((self.unknowns, self.face.size))
        loads[self.face, np.arange(self.face.size)] = 1.0
        moved = np.zeros_like(loads)
        moved[self.free] = self._solver.solve(np.ascontiguousarray(loads[self.free]))
        return moved

    def at_rest(self) -> Equilibrium:
        """Return the equilibrium at zero input: the undeformed body."""
        return Equilibrium(0.0, np.zeros(self.unknowns), 0.0, np.zeros(self.face.size))

    def face_gap_mm(self, displacement_mm: Array) -> Array:
        """Distance of each face point from the symmetry plane (mm)."""
        return np.asarray(self.face_rest_mm + displacement_mm[self.face])

    def measured_mm(self, displacement_mm: Array) -> float:
        """Distance of the measuring point from the symmetry plane (mm)."""
        return float(self.measured_rest_mm + self.weights @ displacement_mm[self.measured])

    def equilibrium(self, input_mm: float, *, contact: bool = False) -> Equilibrium:
        """Equilibrium at one input by small displacements; with `contact`, the symmetry plane stops the fingers."""
        moved = input_mm * self.unit_displacement_mm
        pressed = np.zeros(self.face.size)
        free_gap = self.face_gap_mm(moved)
        if contact and free_gap.min() < 0.0:
            compliance = self.face_displacement_mm[self.face]
            pressed = contact_forces_n(0.5 * (compliance + compliance.T), free_gap)
            moved = moved + self.face_displacement_mm @ pressed
        force_n = 2.0 * float((self.stiffness_n_mm @ moved)[self.driven].sum())
        return Equilibrium(input_mm, moved, force_n, pressed)

    def first_touch_mm(self) -> float | None:
        """Input at which the first face point meets the symmetry plane (mm); None if no face point moves towards it."""
        slope = self.unit_displacement_mm[self.face]
        if np.all(slope <= 0.0):
            return None
        return float(np.max(-self.face_rest_mm[slope > 0.0] / slope[slope > 0.0]))

    def unknowns_in_motion(self, *, drive_held: bool) -> Indices:
        """Indices of the unknowns that take part in vibrations, with the drive held or free along its axis."""
        return self.free if drive_held else np.union1d(self.free, self.driven)

    def modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array]:
        """First symmetric natural modes, without the actuator's mass.

        Parameters
        ----------
        drive_held : bool
            Whether the drive is held along its axis.
        count : int
            How many.

        Returns
        -------
        ndarray of float, shape (count,)
            Angular frequencies in rad/s.
        ndarray of float, shape (unknowns, count)
            Shapes, normalised by the mass of one half.
        """
        return self._modes_among(self.unknowns_in_motion(drive_held=drive_held), count)

    def swaying_modes(self, *, count: int) -> tuple[Array, Array]:
        """First antisymmetric natural modes, with the drive free to move sideways; same return values as `modes`."""
        return self._modes_among(self.swaying, count)

    def _modes_among(self, free: Indices, count: int) -> tuple[Array, Array]:
        stiffness, mass = self.stiffness_n_mm[free][:, free], self.mass_t[free][:, free]
        if free.size < _DENSE_BELOW:
            # Solve the reciprocal eigenvalue problem: lumped masses may be zero, whereas the stiffness is positive
            # definite.
            reciprocal = (free.size - count, free.size - 1)
            inverse, kept = eigh(mass.toarray(), stiffness.toarray(), subset_by_index=reciprocal)
            squared, kept = 1.0 / inverse, kept / np.sqrt(inverse)
        else:
            solver = self._solver if np.array_equal(free, self.free) else factorised(stiffness)
            inverse = LinearOperator(stiffness.shape, solver.solve, dtype=np.float64)
            start = np.ones(free.size)
            squared, kept = eigsh(stiffness.tocsc(), count, mass.tocsc(), sigma=0.0, OPinv=inverse, v0=start)
        order = np.argsort(squared)
        shapes = np.zeros((self.unknowns, count))
        shapes[free] = kept[:, order]
        return np.sqrt(squared[order]), shapes

"""An elastic half gripper, guided and driven: its unknowns, supports, small displacements, contact and modes."""

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
    """Factorise a symmetric matrix with a suitable ordering and pivoting, a sixth faster than SuperLU's default."""
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
    """The right half with its supports; the gripper is two such halves in parallel.

    Parameters
    ----------
    stiffness_n_mm : sparse matrix, shape (unknowns, unknowns)
        Of small motions.
    assemble_mass : callable
        The mass matrix in tonnes, made when it is first asked for: static answers need none.
    tangent : callable
        Displacements to tangent stiffness and internal forces, in the deformed shape.
    driven, free : ndarray of int
        Unknowns that move by the input, and that nothing holds; the others are held.
    swaying : ndarray of int
        Unknowns that nothing holds while both halves move the same way sideways, the drive with them: the symmetry axis
        then cannot move along itself, and the actuator guides nothing across.
    face, face_rest_mm : ndarray
        Unknowns across the symmetry plane of the points that may touch it, and their distances from it at rest.
    measured, weights : ndarray
        Unknowns whose weighted sum is the motion of the measuring point across the symmetry plane.
    measured_rest_mm : float
        Its distance from the symmetry plane at rest.
    nodes : ndarray of int, shape (nodes, 2)
        Unknowns along x and y of every node.
    nodes_mm : ndarray of float, shape (nodes, 2)
        Their places at rest.
    nodal_force : callable or None
        Displacements to internal forces alone, where that is less work than with the tangent.
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
        """Internal forces in the deformed shape, without the tangent matrix where the body can omit it."""
        return self.tangent(displacement)[1] if self.nodal_force is None else self.nodal_force(displacement)

    @cached_property
    def paths(self) -> dict[tuple[float, float, bool, int], list[Equilibrium]]:
        """Cache of equilibria in the deformed shape, by first and last input, contact and number of steps."""
        return {}

    @cached_property
    def touches(self) -> dict[float, Equilibrium]:
        """Cache of first touches in the deformed shape, by the initial estimate."""
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
        """Small displacements of the whole body with the drive fixed, under a unit force on each face point.

        One column each.
        """
        loads = np.zeros((self.unknowns, self.face.size))
        loads[self.face, np.arange(self.face.size)] = 1.0
        moved = np.zeros_like(loads)
        moved[self.free] = self._solver.solve(np.ascontiguousarray(loads[self.free]))
        return moved

    def at_rest(self) -> Equilibrium:
        """Return the undeformed body."""
        return Equilibrium(0.0, np.zeros(self.unknowns), 0.0, np.zeros(self.face.size))

    def face_gap_mm(self, displacement_mm: Array) -> Array:
        """Distance of each face point from the symmetry plane (mm)."""
        return np.asarray(self.face_rest_mm + displacement_mm[self.face])

    def measured_mm(self, displacement_mm: Array) -> float:
        """Distance of the measuring point from the symmetry plane (mm)."""
        return float(self.measured_rest_mm + self.weights @ displacement_mm[self.measured])

    def equilibrium(self, input_mm: float, *, contact: bool = False) -> Equilibrium:
        """Small displacements at one input; with contact, the symmetry plane stops the fingers."""
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
        """Input at which the first face point meets the symmetry plane (mm); None where none moves towards it."""
        slope = self.unit_displacement_mm[self.face]
        if np.all(slope <= 0.0):
            return None
        return float(np.max(-self.face_rest_mm[slope > 0.0] / slope[slope > 0.0]))

    def unknowns_in_motion(self, *, drive_held: bool) -> Indices:
        """Unknowns that can vibrate."""
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
        """First antisymmetric natural modes, with the drive free to move sideways; returns as `modes` does."""
        return self._modes_among(self.swaying, count)

    def _modes_among(self, free: Indices, count: int) -> tuple[Array, Array]:
        stiffness, mass = self.stiffness_n_mm[free][:, free], self.mass_t[free][:, free]
        if free.size < _DENSE_BELOW:
            # The reciprocal problem: lumped masses may be zero, the stiffness is positive definite.
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

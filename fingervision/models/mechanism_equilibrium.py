"""Equilibria of a driven mechanism of any kind: small or large displacements, with or without contact."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, vstack
from scipy.sparse.linalg import SuperLU

from fingervision.domain.errors import ModelError
from fingervision.models.driven_body import factorised
from fingervision.models.signorini import contact_forces_n

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Gaps = tuple[Array, csr_matrix, Callable[[Array], csr_matrix]]
Pairs = tuple[Callable[[Array], Gaps], ...]

_LOAD_STEPS, _NEWTON_STEPS, _SET_CHANGES = 5, 20, 30
_LEAST_STEP = 1e-3
_BLOWN_UP = 1e6
_RESIDUAL = 1e-8
_ON = 1e-6
"""Tolerance of contact as a share of the input: largest gap of a touching node, and largest penetration before a node
is held."""
_SLOW = 0.1
"""Ratio of successive residuals below which the present tangent is kept; a new tangent costs as much as ten steps."""
_MOST_MOTION = 1e6
"""Motion in millimetres per 1 mm of input above which the mechanism counts as not supported; no real mechanism
amplifies as much."""
_STILL = 1e-9
_STRAINLESS = 1e-8
"""Strain energy under all drives together, as a share of the strain energies under each drive alone, below which the
body counts as moving rigidly; rounding errors give 1e-11."""


@dataclass(frozen=True, slots=True, eq=False)
class MechanismEquilibrium:
    """State of a driven mechanism at one input: displacements, forces and contact.

    Parameters
    ----------
    displacement : ndarray of float, shape (unknowns,)
        Displacements in mm, and rotations in rad where the model has them.
    force_n : float
        Force that does the work of the input: the sum of the drives' forces, each times its `per_input`.
    drives_n : ndarray of float, shape (drives,)
        Force at every driven face, along its direction.
    pressed_n : tuple of ndarray of float
        Force on each node of every contact pair; empty if contact is not included.
    """

    displacement: Array
    force_n: float
    drives_n: Array
    pressed_n: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class DrivenMechanism:
    """A driven elastic mechanism.

    Parameters
    ----------
    name : str
        Name of the mechanism in messages.
    tangent : callable
        Maps displacements to the tangent stiffness and the internal forces, in the deformed shape.
    internal : callable
        Maps displacements to the internal forces alone.
    motions : sparse matrix, shape (unknowns, n)
        Basis of the free motions: the displacements are this matrix times the n unknowns solved for, plus the input
        times `by_input`.
    by_drive : ndarray of float, shape (unknowns, drives)
        Prescribed motion per 1 mm of every driven face.
    per_input : ndarray of float, shape (drives,)
        Motion of every driven face per 1 mm of input.
    gaps : tuple of callable
        For every contact pair, a function that maps displacements to the gaps of its nodes (infinite for a node that
        faces nothing) and their derivatives.
    """

    name: str
    tangent: Callable[[Array], tuple[csr_matrix, Array]]
    internal: Callable[[Array], Array]
    motions: csr_matrix
    by_drive: Array
    per_input: Array
    gaps: Pairs = ()

    @cached_property
    def by_input(self) -> Array:
        """Prescribed motion per 1 mm of input, shape (unknowns,)."""
        return np.asarray(self.by_drive @ self.per_input)

    @cached_property
    def stiffness_n_mm(self) -> csr_matrix:
        """Stiffness matrix for small motions."""
        return self.tangent(np.zeros(self.by_input.size))[0]

    @cached_property
    def _solver(self) -> SuperLU:
        return factorised(self.motions.T @ self.stiffness_n_mm @ self.motions)

    @cached_property
    def unit_displacement(self) -> Array:
        """Small displacements per 1 mm of input.

        Raises
        ------
        ModelError
            If the supports allow the mechanism to move freely, or the drives move it without deforming it.
        """
        moved = self.unit_by_drive @ self.per_input
        if self.per_input.size > 1:
            each = np.diag(self.drive_stiffness_n_mm) @ self.per_input**2
            if moved @ (self.stiffness_n_mm @ moved) <= _STRAINLESS * each:
                raise ModelError(
                    f"The drives of {self.name} must deform it, but move it as one rigid body; change per_input or "
                    "direction of one of them."
                )
        return np.asarray(moved)

    @cached_property
    def unit_by_drive(self) -> Array:
        """Small displacements per 1 mm of each driven face, other faces at rest; shape (unknowns, drives).

        Raises
        ------
        ModelError
            If the supports allow the mechanism to move freely.
        """
        try:
            load = self.motions.T @ (self.stiffness_n_mm @ self.by_drive)
            moved = self.by_drive - self.motions @ self._solver.solve(np.ascontiguousarray(load))
        except RuntimeError:  # exactly singular
            moved = np.full(self.by_drive.shape, np.inf)
        if not np.all(np.isfinite(moved)) or np.abs(moved).max() > _MOST_MOTION:
            raise ModelError(f"{self.name} must be held by its fixed faces, but can move freely.")
        return np.asarray(moved)

    @cached_property
    def drive_stiffness_n_mm(self) -> Array:
        """Force at every driven face (row) per 1 mm of every driven face (column), at rest (N/mm)."""
        return np.asarray(self.unit_by_drive.T @ (self.stiffness_n_mm @ self.unit_by_drive))

    @cached_property
    def input_stiffness_n_mm(self) -> float:
        """Force at the drive per 1 mm of input, at rest (N/mm)."""
        moved = self.unit_displacement
        return float(moved @ (self.stiffness_n_mm @ moved))

    def by_one_drive(self) -> tuple[MechanismEquilibrium, ...]:
        """Small displacements per 1 mm of each driven face, with the other driven faces at rest, without contact."""
        pairs = zip(self.unit_by_drive.T, self.drive_stiffness_n_mm.T, strict=True)
        return tuple(
            MechanismEquilibrium(moved, float(forces[i]), forces, ()) for i, (moved, forces) in enumerate(pairs)
        )

    def under_load(self, load_n: Array) -> Array:
        """Small displacements under one load, or under each column of loads, with the drive fixed."""
        return np.asarray(self.motions @ self._solver.solve(np.ascontiguousarray(self.motions.T @ load_n)))

    def touch_inputs_mm(self) -> list[float | None]:
        """Input nearest to zero (mm) at which each contact pair touches, for small displacements; None if never."""
        found: list[float | None] = []
        for gaps in self.gaps:
            gap, slope, _ = gaps(np.zeros(self.by_input.size))
            speed = slope @ self.unit_displacement
            facing = np.isfinite(gap) & (np.abs(speed) > _STILL)
            touches = -gap[facing] / speed[facing]
            found.append(float(touches[np.argmin(np.abs(touches))]) if touches.size else None)
        return found

    def equilibrium(self, input_mm: float, *, large_rotation: bool, contact: bool) -> MechanismEquilibrium:
        """Find the equilibrium at one input.

        Raises
        ------
        ModelError
            If the equilibrium cannot be reached by steps from rest.
        """
        gaps = self.gaps if contact else ()
        if large_rotation:
            return self._followed(input_mm, gaps)
        moved, pressed = input_mm * self.unit_displacement, ()
        if not gaps:
            drives = self.drive_stiffness_n_mm @ self.per_input * input_mm
            return MechanismEquilibrium(moved, self.input_stiffness_n_mm * input_mm, drives, pressed)
        gap, slope, by_force = self._touching
        apart, facing = gap + slope @ moved, np.isfinite(gap)
        forces = np.zeros(gap.size)
        if np.any(apart[facing] < 0.0):
            compliance = (slope @ by_force)[np.ix_(facing, facing)]
            forces[facing] = contact_forces_n(0.5 * (compliance + compliance.T), apart[facing])
            moved = moved + by_force @ forces
        drives = self.by_drive.T @ (self.stiffness_n_mm @ moved - slope.T @ forces)
        return MechanismEquilibrium(moved, float(self.per_input @ drives), drives, self._by_pair(forces))

    @cached_property
    def _touching(self) -> tuple[Array, Array, Array]:
        """Gaps at rest of the nodes that may touch, the gaps' derivatives, displacements for unit contact forces."""
        gap, sparse, _ = self._all_gaps(self.gaps, np.zeros(self.by_input.size))
        slope = np.where(np.isfinite(gap)[:, None], sparse.toarray(), 0.0)
        return gap, slope, self.under_load(slope.T)

    def _by_pair(self, forces: Array) -> tuple[Array, ...]:
        sizes = [gaps(np.zeros(self.by_input.size))[0].size for gaps in self.gaps]
        return tuple(np.split(forces, np.cumsum(sizes)[:-1]))

    def _all_gaps(self, pairs: Pairs, moved: Array) -> Gaps:
        parts = [gaps(moved) for gaps in pairs]
        gap = np.concatenate([np.zeros(0), *(part[0] for part in parts)])
        slope = vstack([csr_matrix((0, moved.size)), *(part[1] for part in parts)], format="csr")
        sizes = np.cumsum([part[0].size for part in parts])[:-1]

        def bend(forces: Array) -> csr_matrix:
            shares = np.split(forces, sizes) if parts else []
            whole = csr_matrix((moved.size, moved.size))
            return csr_matrix(sum((part[2](own) for part, own in zip(parts, shares, strict=True)), whole))

        return gap, slope, bend

    def _followed(self, input_mm: float, pairs: Pairs) -> MechanismEquilibrium:
        """Follow the equilibria from rest, in steps that grow after convergence and are halved after a failure."""
        moved = np.zeros(self.by_input.size)
        path = [(0.0, moved)]
        touching = np.zeros(self._all_gaps(pairs, moved)[0].size, dtype=bool)
        pressed = np.zeros(touching.size)
        reached, step = 0.0, 1.0 / _LOAD_STEPS
        while input_mm != 0.0 and reached < 1.0:
            to = min(1.0, reached + step)
            found = self._settled(self._predicted(path, to * input_mm), touching, pressed, to * input_mm, pairs)
            if found is not None:
                moved, touching, pressed = found
                path, reached, step = [*path[-2:], (to * input_mm, moved)], to, 1.5 * step
                continue
            step *= 0.5
            if step < _LEAST_STEP:
                raise ModelError(
                    f"The equilibrium of {self.name} could be computed up to an input of "
                    f"{reached * input_mm:.4g} mm only, but {input_mm:g} mm are requested; take a smaller input."
                )
        loads = self.internal(moved) - self._all_gaps(pairs, moved)[1].T @ pressed
        drives = np.asarray(self.by_drive.T @ loads)
        by_pair = self._by_pair(pressed) if pairs else ()
        return MechanismEquilibrium(moved, float(self.per_input @ drives), drives, by_pair)

    def _predicted(self, path: list[tuple[float, Array]], input_mm: float) -> Array:
        """Extrapolate the path; from rest, use the small displacements.

        Without extrapolation, slender leaf flexures would be stretched at the start of every step.
        """
        if len(path) == 1:
            return input_mm * self.unit_displacement
        inputs = [at for at, _ in path]
        moved = np.zeros_like(path[0][1])
        for place, (at, displacement) in enumerate(path):
            others = inputs[:place] + inputs[place + 1 :]
            moved += np.prod([(input_mm - other) / (at - other) for other in others]) * displacement
        return moved

    def _settled(
        self, moved: Array, touching: Flags, pressed: Array, input_mm: float, pairs: Pairs
    ) -> tuple[Array, Flags, Array] | None:
        """Hold nodes that would penetrate and release nodes under tension, until no such nodes are left."""
        for _ in range(_SET_CHANGES):
            found = self._newton(moved, touching, pressed, input_mm, pairs)
            if found is None:
                return None
            moved, pressed = found
            gap, _, _ = self._all_gaps(pairs, moved)
            wanted = (touching & (pressed > 0.0) & np.isfinite(gap)) | (gap < -_ON * abs(input_mm))
            if np.array_equal(wanted, touching):
                return moved, touching, pressed
            touching, pressed = wanted, np.where(wanted, pressed, 0.0)
        return None

    def _newton(
        self, moved: Array, touching: Flags, pressed: Array, input_mm: float, pairs: Pairs
    ) -> tuple[Array, Array] | None:
        """Newton's method for a given set of touching nodes; returns None if it does not converge."""
        motions = self.motions
        scale = float(np.abs(self.stiffness_n_mm @ self.unit_displacement).max()) * abs(input_mm)
        solver, before = None, np.inf
        for _ in range(_NEWTON_STEPS):
            gap, slopes, bend = self._all_gaps(pairs, moved)
            held = touching & np.isfinite(gap)
            slope, gap = slopes[held], gap[held]
            loads = motions.T @ (self.internal(moved) - slope.T @ pressed[held])
            residual = float(np.abs(loads).max())
            if residual <= _RESIDUAL * scale and np.all(np.abs(gap) <= _ON * abs(input_mm)):
                return moved, pressed
            if not residual <= _BLOWN_UP * scale:
                return None
            if solver is None or residual > _SLOW * before:
                tangent = self.tangent(moved)[0]
                if gap.size:
                    tangent = tangent - bend(np.where(held, pressed, 0.0))
                solver = factorised(motions.T @ tangent @ motions)
            step = -solver.solve(loads)
            if gap.size:
                across = (slope @ motions).toarray()
                by_force = solver.solve(np.ascontiguousarray(across.T))
                more = np.linalg.solve(across @ by_force, -gap - across @ step)
                step = step + by_force @ more
                pressed = pressed.copy()
                pressed[held] += more
            moved, before = moved + motions @ step, residual
        return None

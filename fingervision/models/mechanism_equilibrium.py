"""Equilibria of a driven mechanism of any kind: small or large displacements, with or without contact."""

from bisect import insort
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csr_matrix, diags, hstack, vstack
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh, splu

from fingervision.domain.errors import ModelError

# Frictionless contact with a rigid plane (Signorini's problem), reduced to the points that may touch.

Array = NDArray[np.float64]


def contact_forces_n(compliance_mm_n: Array, free_gap_mm: Array) -> Array:
    """Find the forces that keep every point on its side of the plane.

    With the compliance matrix C, the equation gap = free_gap + C force is solved for gap >= 0, force >= 0, gap * force
    = 0. The forces f minimise f' C f / 2 + g' f over f >= 0, with the free gap g. This quadratic programme is solved as
    a non-negative least-squares problem, by the factorisation C = L L'.

    Parameters
    ----------
    compliance_mm_n : ndarray of float, shape (n, n)
        Displacement away from the plane at point i by a unit force at point j; symmetric and positive definite.
    free_gap_mm : ndarray of float, shape (n,)
        Distance from the plane without contact; negative where a point would pass through.

    Returns
    -------
    ndarray of float, shape (n,)
        Contact forces.
    """
    if np.all(free_gap_mm >= 0.0):
        return np.zeros_like(free_gap_mm)
    factor = np.linalg.cholesky(compliance_mm_n)
    target = scipy.linalg.solve_triangular(factor, -free_gap_mm, lower=True)
    forces, _ = scipy.optimize.nnls(factor.T, target)
    return np.asarray(forces)


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
_EXTRAPOLATED, _LEAST_APART = 3, 1e-3
"""Number of equilibria from which the next one is extrapolated, and their least distance as a share of the input."""
_TOUCHES = 1e-7
"""Gap, as a share of the input, at which a node counts as just touching."""
_SLOW = 0.1
"""Ratio of successive residuals below which the present tangent is kept; a new tangent costs as much as ten steps."""
_MOST_MOTION = 1e6
"""Motion in millimetres per 1 mm of input above which the mechanism counts as not supported; no real mechanism
amplifies as much."""
_DENSE_BELOW = 1000
"""Number of unknowns below which natural modes are found with full matrices."""
_STILL = 1e-9
_CLOSE = 1e-4
"""Relative error of eigenvalues of which few digits count."""
_STRAINLESS = 1e-8
"""Strain energy under all drives together, as a share of the strain energies under each drive alone, below which the
body counts as moving rigidly; rounding errors give 1e-11."""


def factorised(matrix: csr_matrix) -> SuperLU:
    """Factorise a symmetric matrix with an ordering and pivoting that is a sixth faster than SuperLU's default."""
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


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


@dataclass(frozen=True, slots=True, eq=False)
class _Reached:
    """Equilibrium in the deformed shape: size of the input (mm), displacements, touching nodes and their forces (N)."""

    size_mm: float
    moved: Array
    touching: Flags
    pressed: Array


def _spread(path: list[_Reached], size_mm: float) -> list[_Reached]:
    """Last states of a path, at most three, that lie far enough apart to be extrapolated without their rounding errors.

    Two tables of inputs may have the same input but for its last digits.
    """
    kept = [path[-1]]
    for state in path[-2::-1]:
        if len(kept) < _EXTRAPOLATED and kept[0].size_mm - state.size_mm > _LEAST_APART * size_mm:
            kept.insert(0, state)
    return kept


@dataclass(frozen=True, slots=True, eq=False)
class Actuators:
    """The actuators of a mechanism's drives, those that yield or prescribe a force (soft ones) and rigid stages.

    A soft actuator pushes its face with the force `push_n` times its input, less `spring_n_mm` times the face's motion.

    Parameters
    ----------
    rows : ndarray of float, shape (unknowns, drives)
        Weights of the unknowns in the motion of every soft drive's face; zero for a stage.
    spring_n_mm, push_n : ndarray of float, shape (drives,)
        Stiffness, and force per unit of input, of every actuator; zero for a stage.
    """

    rows: Array
    spring_n_mm: Array
    push_n: Array

    def forces_n(self, settings: Array, moved: Array) -> Array:
        """Force of every soft actuator (row) at given inputs of the drives and displacements; zero for a stage."""
        by_face = self.spring_n_mm * (self.rows.T @ moved).T
        return np.asarray((self.push_n * settings.T - by_face).T)


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
    mass : callable
        Returns the mass matrix in tonnes; called when it is first needed, because static results do not need it.
    gaps : tuple of callable
        For every contact pair, a function that maps displacements to the gaps of its nodes (infinite for a node that
        faces nothing) and their derivatives.
    actuators : Actuators or None
        Actuators of the drives; None where every drive is a stage.
    rest_mm : ndarray of float, shape (unknowns,) or (1,)
        Displacements under the preload of the drives, from which all other displacements are counted.
    rest_faces_mm, preload_n : ndarray of float, shape (drives,) or (1,)
        Motion of every driven face by the preload, and force of every drive at rest, along its direction.
    unloaded : DrivenMechanism or None
        The system without its preload; None where there is none.
    """

    name: str
    tangent: Callable[[Array], tuple[csr_matrix, Array]]
    internal: Callable[[Array], Array]
    motions: csr_matrix
    by_drive: Array
    per_input: Array
    mass: Callable[[], csr_matrix]
    gaps: Pairs = ()
    actuators: Actuators | None = None
    rest_mm: Array = field(default_factory=lambda: np.zeros(1))
    rest_faces_mm: Array = field(default_factory=lambda: np.zeros(1))
    preload_n: Array = field(default_factory=lambda: np.zeros(1))
    unloaded: "DrivenMechanism | None" = None

    def preloaded(self, rows: Array, preload_n: Array) -> "DrivenMechanism":
        """Return the system about its equilibrium under forces that press on its driven faces, in the deformed shape.

        The faces that are pressed are free to move along their drives until equilibrium is reached; from there on they
        move as their drives do. The stress of the preload adds its geometric stiffness to every result.

        Parameters
        ----------
        rows : ndarray of float, shape (unknowns, drives)
            Weights of the unknowns in the motion of every driven face.
        preload_n : ndarray of float, shape (drives,)
            Force along every drive.

        Raises
        ------
        ModelError
            If there is no stable equilibrium, because the preload buckles the mechanism.
        """
        motions = csr_matrix(hstack([self.motions, csr_matrix(self.by_drive[:, preload_n != 0.0])]))
        load, rest_mm = rows @ preload_n, np.zeros(self.unknowns)
        for step in range(1, _LOAD_STEPS + 1):
            share = step / _LOAD_STEPS
            for _ in range(_NEWTON_STEPS):
                tangent, force = self.tangent(rest_mm)
                apart = motions.T @ (force - share * load)
                solver = factorised(motions.T @ tangent @ motions)
                is_held = bool(np.abs(apart).max() <= _RESIDUAL * np.abs(motions.T @ load).max())
                if is_held or not np.all(np.isfinite(apart)):
                    break
                rest_mm = rest_mm - motions @ solver.solve(apart)
            # The pivots of a symmetric matrix have the signs of its eigenvalues (Sylvester's law of inertia).
            if not is_held or solver.U.diagonal().min() <= 0.0:
                words = " and ".join(f"{force_n:g} N" for force_n in preload_n[preload_n != 0.0].tolist())
                raise ModelError(
                    f"{self.name} must carry its preload of {words}, but buckles or yields freely between "
                    f"{100.0 * (share - 1.0 / _LOAD_STEPS):g} and {100.0 * share:g} % of it; press less, or make the "
                    "flexures that it presses thicker or shorter."
                )

        def tangent_there(moved: Array) -> tuple[csr_matrix, Array]:
            stiffness, force = self.tangent(rest_mm + moved)
            return stiffness, force - load

        def shifted(gaps: Callable[[Array], Gaps]) -> Callable[[Array], Gaps]:
            return lambda moved: gaps(rest_mm + moved)

        return replace(
            self,
            tangent=tangent_there,
            internal=lambda moved: self.internal(rest_mm + moved) - load,
            gaps=tuple(shifted(gaps) for gaps in self.gaps),
            rest_mm=rest_mm,
            rest_faces_mm=rows.T @ rest_mm,
            preload_n=preload_n,
        )

    def actuated(self, actuators: Actuators, soft: Flags) -> "DrivenMechanism":
        """Return the system with some drives moved by soft actuators, so that their faces are free to move.

        The springs of the actuators become part of the stiffness, and their pushes are loads.
        """
        rows = csr_matrix(actuators.rows)
        springs = csr_matrix(rows @ diags(actuators.spring_n_mm) @ rows.T)

        def tangent(moved: Array) -> tuple[csr_matrix, Array]:
            stiffness, force = self.tangent(moved)
            return csr_matrix(stiffness + springs), force + springs @ moved

        return replace(
            self,
            tangent=tangent,
            internal=lambda moved: self.internal(moved) + springs @ moved,
            motions=csr_matrix(hstack([self.motions, csr_matrix(self.by_drive[:, soft])])),
            by_drive=np.where(soft, 0.0, self.by_drive),
            actuators=actuators,
        )

    @cached_property
    def load_by_drive(self) -> Array:
        """Loads of soft actuators per unit of every drive's input, shape (unknowns, drives)."""
        zero = np.zeros(self.by_drive.shape)
        return zero if self.actuators is None else self.actuators.rows * self.actuators.push_n

    @cached_property
    def body_stiffness_n_mm(self) -> csr_matrix:
        """Stiffness matrix for small motions without the springs of actuators."""
        if self.actuators is None:
            return self.stiffness_n_mm
        rows = csr_matrix(self.actuators.rows)
        return csr_matrix(self.stiffness_n_mm - rows @ diags(self.actuators.spring_n_mm) @ rows.T)

    def drive_forces_n(self, settings: Array, moved: Array, loads_n: Array) -> Array:
        """Force at every drive without its preload, from inputs, displacements, and internal forces less all loads."""
        forces = np.asarray(self.by_drive.T @ loads_n)
        return forces if self.actuators is None else forces + self.actuators.forces_n(settings, moved)

    def face_motions(self, moved: Array, input_mm: float) -> Array:
        """Motion of every driven face along its direction, shape (drives,)."""
        settings = self.per_input * input_mm
        if self.actuators is None:
            return settings
        return np.where(self.actuators.rows.any(axis=0), self.actuators.rows.T @ moved, settings)

    @property
    def unknowns(self) -> int:
        """Number of displacement components."""
        return int(self.by_drive.shape[0])

    @cached_property
    def mass_t(self) -> csr_matrix:
        """Mass matrix in tonnes."""
        return self.mass()

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
        if self.per_input.size > 1 and self.actuators is None:
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
            load = self.motions.T @ (self.stiffness_n_mm @ self.by_drive - self.load_by_drive)
            moved = self.by_drive - self.motions @ self._solver.solve(np.ascontiguousarray(load))
        except RuntimeError:  # exactly singular
            moved = np.full(self.by_drive.shape, np.inf)
        if not np.all(np.isfinite(moved)) or np.abs(moved).max() > _MOST_MOTION:
            raise ModelError(f"{self.name} must be held by its fixed faces, but can move freely.")
        return np.asarray(moved)

    @cached_property
    def drive_stiffness_n_mm(self) -> Array:
        """Force at every driven face (row) per 1 mm of every driven face (column), at rest (N/mm)."""
        unit = self.unit_by_drive
        forces = np.asarray(unit.T @ (self.stiffness_n_mm @ unit - self.load_by_drive))
        return forces if self.actuators is None else forces + self.actuators.forces_n(np.eye(self.per_input.size), unit)

    @cached_property
    def input_stiffness_n_mm(self) -> float:
        """Force at the drive per 1 mm of input, at rest (N/mm)."""
        if self.actuators is not None:
            return float(self.per_input @ self.drive_stiffness_n_mm @ self.per_input)
        moved = self.unit_displacement
        return float(moved @ (self.stiffness_n_mm @ moved))

    def by_one_drive(self) -> tuple[MechanismEquilibrium, ...]:
        """Small displacements per 1 mm of each driven face, with the other driven faces at rest, without contact."""
        pairs = zip(self.unit_by_drive.T, self.drive_stiffness_n_mm.T, strict=True)
        return tuple(
            replace(self._state(moved, forces), force_n=float(forces[i])) for i, (moved, forces) in enumerate(pairs)
        )

    def _state(self, moved: Array, drives_n: Array, pressed_n: tuple[Array, ...] = ()) -> MechanismEquilibrium:
        """State with the preload, from displacements and forces that are counted from rest."""
        drives_n = drives_n + self.preload_n
        return MechanismEquilibrium(self.rest_mm + moved, float(self.per_input @ drives_n), drives_n, pressed_n)

    def under_load(self, load_n: Array) -> Array:
        """Small displacements under one load, or under each column of loads, with the drive fixed."""
        return np.asarray(self.motions @ self._solver.solve(np.ascontiguousarray(self.motions.T @ load_n)))

    def modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array, Array]:
        """First natural modes, with the drive fixed or free to move along its direction.

        With a soft actuator, fixed means that the actuator holds its input, and free that it is taken away.

        Returns
        -------
        rad_s : ndarray of float, shape (count,)
            Angular frequencies, in rising order.
        shapes : ndarray of float, shape (unknowns, count)
            Mode shapes of unit modal mass.
        drive : ndarray of float, shape (count,)
            Motion of the input in each mode, for a soft actuator of its face; zero with the drive held.
        """
        columns, by_stage = self.motions, not drive_held and bool(self.by_input.any())
        if by_stage:
            columns = hstack([columns, csr_matrix(self.by_input[:, None])], format="csr")
        stiffness = self.stiffness_n_mm if drive_held else self.body_stiffness_n_mm
        K, M = ((columns.T @ matrix @ columns).tocsc() for matrix in (stiffness, self.mass_t))
        size = K.shape[0]
        if size < _DENSE_BELOW:
            # Solve the reciprocal eigenvalue problem: masses may be zero, whereas the stiffness is positive definite.
            inverse, sought = eigh(M.toarray(), K.toarray(), subset_by_index=(size - count, size - 1))
            squared, sought = 1.0 / inverse, sought / np.sqrt(inverse)
        else:
            solver = self._solver if drive_held else factorised(K)
            by_load = LinearOperator(K.shape, solver.solve, dtype=np.float64)
            squared, sought = eigsh(K, count, M, sigma=0.0, OPinv=by_load, v0=np.ones(size))
        order = np.argsort(squared)
        shapes = np.asarray(columns @ sought[:, order])
        drive = np.zeros(count) if drive_held else sought[-1, order]
        if not drive_held and not by_stage and self.actuators is not None:
            drive = self.per_input @ (self.actuators.rows.T @ shapes) / (self.per_input @ self.per_input)
        return np.sqrt(squared[order]), shapes, drive

    def eigenvalues(self, matrix: csr_matrix, count: int) -> list[float]:
        """Eigenvalues of largest size of a symmetric matrix relative to the stiffness at rest."""
        own, rest = (csr_matrix(self.motions.T @ each @ self.motions) for each in (matrix, self.stiffness_n_mm))
        inverse = LinearOperator(rest.shape, self._solver.solve, dtype=np.float64)
        start = np.ones(rest.shape[0])
        found = eigsh(own, count, rest, Minv=inverse, v0=start, tol=_CLOSE, return_eigenvectors=False)
        return [float(value) for value in found]

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

    def equilibrium(
        self,
        input_mm: float,
        *,
        large_rotation: bool = False,
        contact: bool = False,
        between: tuple[float, float] = (0.0, 0.0),
    ) -> MechanismEquilibrium:
        """Find the equilibrium at one input.

        Parameters
        ----------
        input_mm : float
            Input.
        large_rotation, contact : bool
            Whether the equilibrium is that of the deformed shape, and whether faces stop each other.
        between : (float, float)
            Thickness (mm) of a part that fills the gaps of the contacts, and its compliance (mm/N) at every gap; for
            small displacements with contact.

        Raises
        ------
        ModelError
            If the equilibrium cannot be reached by steps from rest.
        """
        gaps = self.gaps if contact else ()
        if large_rotation:
            return self._followed(input_mm, gaps)
        moved = input_mm * self.unit_displacement
        if not gaps:
            found = self._state(moved, self.drive_stiffness_n_mm @ self.per_input * input_mm)
            at_rest = float(np.sum(self.per_input * self.preload_n))
            return replace(found, force_n=at_rest + self.input_stiffness_n_mm * input_mm)
        gap, slope, by_force = self._touching
        apart, facing = gap + slope @ moved - between[0], np.isfinite(gap)
        forces = np.zeros(gap.size)
        if np.any(apart[facing] < 0.0):
            compliance = (slope @ by_force)[np.ix_(facing, facing)]
            forces[facing] = contact_forces_n(0.5 * (compliance + compliance.T) + between[1], apart[facing])
            moved = moved + by_force @ forces
        settings = self.per_input * input_mm
        drives = self.drive_forces_n(settings, moved, self.stiffness_n_mm @ moved - slope.T @ forces)
        return self._state(moved, drives, self._by_pair(forces))

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
        known = self._known.setdefault((bool(pairs), input_mm > 0.0), [self._at_rest(pairs)])
        path = [state for state in known if state.size_mm <= abs(input_mm)]
        step_mm = abs(input_mm) / _LOAD_STEPS
        while (last := path[-1]).size_mm < abs(input_mm):
            to = min(abs(input_mm), last.size_mm + step_mm)
            at = float(np.copysign(to, input_mm))
            found = self._settled(self._predicted(_spread(path, to), at), last.touching, last.pressed, at, pairs)
            if found is not None:
                path.append(_Reached(to, *found))
                insort(known, path[-1], key=lambda state: state.size_mm)
                step_mm *= 1.5
                continue
            step_mm = 0.5 * (to - last.size_mm)
            if step_mm < _LEAST_STEP * abs(input_mm):
                raise ModelError(
                    f"The equilibrium of {self.name} could be computed up to an input of "
                    f"{np.copysign(last.size_mm, input_mm):.4g} mm only, but {input_mm:g} mm are requested; take a "
                    "smaller input."
                )
        moved, pressed = path[-1].moved, path[-1].pressed
        loads = self.internal(moved) - self._all_gaps(pairs, moved)[1].T @ pressed
        drives = self.drive_forces_n(self.per_input * input_mm, moved, loads)
        return self._state(moved, drives, self._by_pair(pressed) if pairs else ())

    @cached_property
    def _known(self) -> dict[tuple[bool, bool], list["_Reached"]]:
        """Equilibria in the deformed shape, from rest outwards, by contact and sign of the input."""
        return {}

    def _at_rest(self, pairs: Pairs) -> "_Reached":
        moved = np.zeros(self.by_input.size)
        nodes = self._all_gaps(pairs, moved)[0].size
        return _Reached(0.0, moved, np.zeros(nodes, dtype=bool), np.zeros(nodes))

    def first_touch(self, guess_mm: float) -> float:
        """Input (mm) at which the first node meets what it faces, in the deformed shape, by Newton's method.

        Raises
        ------
        ModelError
            If no such input is found near the one for small displacements, `guess_mm`.
        """
        at_mm = guess_mm
        for _ in range(_NEWTON_STEPS):
            moved = self._followed(at_mm, ()).displacement - self.rest_mm
            gap, slope, _ = self._all_gaps(self.gaps, moved)
            place = int(np.argmin(gap))
            if abs(gap[place]) < _TOUCHES * abs(guess_mm):
                return at_mm
            at_mm -= float(gap[place] / (slope[place] @ self.unit_displacement)[0])
        raise ModelError(f"The input at which {self.name} first touches was not found near {guess_mm:g} mm.")

    def _predicted(self, path: list["_Reached"], input_mm: float) -> Array:
        """Extrapolate the path; from rest, use the small displacements.

        Without extrapolation, slender leaf flexures would be stretched at the start of every step.
        """
        if len(path) == 1:
            return input_mm * self.unit_displacement
        size_mm, moved = abs(input_mm), np.zeros_like(path[0].moved)
        for state in path:
            others = [other.size_mm for other in path if other is not state]
            moved += np.prod([(size_mm - at) / (state.size_mm - at) for at in others]) * state.moved
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
        # Beside a preload, the rounding errors are those of its forces.
        scale = float(np.abs(self.stiffness_n_mm @ self.unit_displacement).max()) * abs(input_mm)
        scale += float(np.abs(self.preload_n).max())
        solver, before = None, np.inf
        pushed = self.load_by_drive @ (self.per_input * input_mm)
        for _ in range(_NEWTON_STEPS):
            gap, slopes, bend = self._all_gaps(pairs, moved)
            held = touching & np.isfinite(gap)
            slope, gap = slopes[held], gap[held]
            loads = motions.T @ (self.internal(moved) - slope.T @ pressed[held] - pushed)
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

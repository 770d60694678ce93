"""A planar mechanism by finite elements: any topology, small or large displacements, stress and natural modes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, hstack, identity
from scipy.sparse.linalg import eigsh

from fingervision.domain.errors import FingervisionError
from fingervision.models.driven_body import factorised
from fingervision.models.mechanism import Face, Mechanism, check_mechanism
from fingervision.models.modal_model import FreeModes, ModalModel, Observable
from fingervision.models.planar_region import PlanarRegion, sharp_corners_mm
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.triangulate import PlaneMesh, triangulate
from fingervision.models.width_effect import force_uncertainty

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ON = 1e-7
"""Of the body's size: how near a node must be to a face's box."""
_ACROSS, _BODY = 4.0, 0.025
"""Triangles across what is thin, and edge length over the body's size: as for the paper's sample."""
_BESIDE_CORNER = 0.5
"""Of the thinnest flexure: stress nearer to a sharp corner is a figure of the mesh, and is left out."""
_MOST_MOTION = 1e6
"""Millimetres by 1 mm of input: no mechanism amplifies so, but one that nothing holds."""
_NEWTON_STEPS, _RESIDUAL = 30, 1e-8
_LOAD_STEPS = 5


@dataclass(frozen=True, slots=True)
class MechanismState:
    """A mechanism at one input.

    Parameters
    ----------
    input_mm, force_n : float
        Motion of the drive along its direction, and the force there.
    probes_mm : dict of str to (float, float)
        Displacements of the probes.
    pairs_mm : dict of str to float
        Distances of the pairs.
    stress_mpa : float
        Largest von Mises stress in the flexures, half a thickness and more from sharp corners, where it has no limit.
    displacement_mm : ndarray of float, shape (unknowns,)
        Of every node.
    """

    input_mm: float
    force_n: float
    probes_mm: dict[str, tuple[float, float]]
    pairs_mm: dict[str, float]
    stress_mpa: float
    displacement_mm: Array


class MechanismPlate:
    """A meshed mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    width_effect : bool
        Whether the plate's width holds the flexures back; plane stress where not.
    refine : float
        Edge lengths are divided by it.

    Raises
    ------
    FingervisionError
        Where the drawing is no mechanism or a face holds no nodes of the outline.
    """

    def __init__(self, mechanism: Mechanism, *, width_effect: bool = True, refine: float = 1.0) -> None:
        self.mechanism = mechanism
        region = mechanism.region
        check_mechanism(mechanism, region)
        self._size_mm = region.size_mm
        self.mesh: PlaneMesh = triangulate(region, _ACROSS * refine, _BODY * self._size_mm / refine)
        zones = tuple(flexure.zone(mechanism.plate_mm) for flexure in mechanism.flexures)
        used = zones if width_effect else ()
        self.plate = PlaneStressPlate(self.mesh, mechanism.material, mechanism.plate_mm, used)
        middles = self.mesh.nodes_mm[:, self.mesh.triangles[:3]].mean(axis=1)
        inside = [zone.holds(middles) for zone in zones] or [np.ones(middles.shape[1], dtype=bool)]
        self._in_flexure = np.any(inside, axis=0) & ~self._beside_sharp_corners(region, middles)
        self._support()

    def _beside_sharp_corners(self, region: PlanarRegion, points: Array) -> NDArray[np.bool_]:
        """Points within half a thickness of a sharp re-entrant corner, where the stress of elasticity has no limit."""
        flexures = self.mechanism.flexures
        near_mm = _BESIDE_CORNER * min((flexure.thickness_mm for flexure in flexures), default=0.0)
        beside = np.zeros(points.shape[1], dtype=bool)
        for corner in sharp_corners_mm(region):
            beside |= np.hypot(points[0] - corner[0], points[1] - corner[1]) < near_mm
        return beside

    def _support(self) -> None:
        mechanism, plate = self.mechanism, self.plate
        held = np.concatenate([np.concatenate([plate.x_dofs[n], plate.y_dofs[n]])
                               for n in map(self._on_face, mechanism.fixed)] or [np.zeros(0, int)])  # fmt: skip
        for face, component in mechanism.slides:
            nodes = self._on_face(face)
            held = np.concatenate([held, (plate.x_dofs if component == "x" else plate.y_dofs)[nodes]])
        driven = self._on_face(mechanism.drive.face)
        dx, dy = mechanism.drive.direction
        self._by_input = np.zeros(plate.unknowns)
        self._by_input[plate.x_dofs[driven]], self._by_input[plate.y_dofs[driven]] = dx, dy
        guided = mechanism.drive.across == "held"
        parts = [plate.x_dofs[driven]] * (guided or dx != 0.0) + [plate.y_dofs[driven]] * (guided or dy != 0.0)
        prescribed = np.concatenate(parts)
        both = np.intersect1d(held, prescribed)
        if np.any(self._by_input[both] != 0.0):
            raise FingervisionError(
                f"The drive of {mechanism.name} must be free to move, but its face {mechanism.drive.face.name} is "
                "fixed too."
            )
        if not mechanism.fixed and not mechanism.slides:
            raise FingervisionError(f"{mechanism.name} must have a [[fixed]] face, but has none.")
        self._free = np.setdiff1d(np.arange(plate.unknowns), np.concatenate([held, prescribed]))

    def _on_face(self, face: Face) -> Indices:
        x, y = self.plate.nodes_mm
        x0, x1, y0, y1 = face.box_mm
        near = _ON * self._size_mm
        outline = np.unique(self.plate.outline_edges)
        inside = (x >= x0 - near) & (x <= x1 + near) & (y >= y0 - near) & (y <= y1 + near)
        nodes = outline[inside[outline]]
        if nodes.size < 2:
            raise FingervisionError(
                f"face {face.name} of {self.mechanism.name} must hold a part of the outline, but its box "
                f"[{x0:g}, {x1:g}, {y0:g}, {y1:g}] mm holds none."
            )
        return np.asarray(nodes)

    @cached_property
    def unit_displacement_mm(self) -> Array:
        """Small displacements by 1 mm of input."""
        free, K = self._free, self.plate.stiffness_n_mm
        moved = self._by_input.copy()
        moved[free] = 0.0
        try:
            moved[free] = factorised(K[free][:, free]).solve(-(K @ moved)[free])
        except RuntimeError:  # exactly singular
            moved[free] = np.inf
        if not np.all(np.isfinite(moved)) or np.abs(moved).max() > _MOST_MOTION or self._wanders():
            raise FingervisionError(f"{self.mechanism.name} must be held by its fixed faces, but can move freely.")
        return moved

    def _wanders(self) -> bool:
        """Whether the held unknowns allow a motion of the whole body."""
        x, y = self.plate.nodes_mm
        whole = np.zeros((3, self.plate.unknowns))
        whole[0, self.plate.x_dofs], whole[1, self.plate.y_dofs] = 1.0, 1.0
        whole[2, self.plate.x_dofs], whole[2, self.plate.y_dofs] = -(y - y.mean()), x - x.mean()
        held = np.setdiff1d(np.arange(self.plate.unknowns), self._free)
        return bool(np.linalg.matrix_rank(whole[:, held] / np.abs(whole).max(axis=1)[:, None], tol=1e-6) < 3)

    @property
    def stiffness_n_mm(self) -> float:
        """Force at the drive by 1 mm of input, at rest."""
        moved = self.unit_displacement_mm
        return float(moved @ (self.plate.stiffness_n_mm @ moved))

    @property
    def force_error(self) -> float:
        """Relative model error of the force: of the mesh and the width effect."""
        return 0.005 + 2.0 * force_uncertainty(self.mechanism.material)

    def state(self, input_mm: float, *, large_rotation: bool = False) -> MechanismState:
        """Find the equilibrium at one input."""
        if not large_rotation:
            moved = input_mm * self.unit_displacement_mm
            return self._state(input_mm, moved, self.stiffness_n_mm * input_mm, large=False)
        moved, force = np.zeros(self.plate.unknowns), 0.0
        for step in range(1, _LOAD_STEPS + 1):
            moved = moved + input_mm / _LOAD_STEPS * self.unit_displacement_mm
            moved, internal = self._newton(moved, input_mm)
            force = float(self._by_input @ internal)
            del step
        return self._state(input_mm, moved, force, large=True)

    def _newton(self, moved: Array, input_mm: float) -> tuple[Array, Array]:
        free = self._free
        scale = float(np.abs(self.plate.stiffness_n_mm @ self.unit_displacement_mm).max()) * abs(input_mm)
        for _ in range(_NEWTON_STEPS):
            tangent, internal = self.plate.internal_force_n(moved)
            if np.abs(internal[free]).max() <= _RESIDUAL * scale:
                return moved, internal
            step = np.zeros_like(moved)
            step[free] = factorised(tangent[free][:, free]).solve(-internal[free])
            moved = moved + step
        raise FingervisionError(
            f"The equilibrium of {self.mechanism.name} at {input_mm:g} mm was not found in {_NEWTON_STEPS} steps; "
            "take a smaller input."
        )

    def _state(self, input_mm: float, moved: Array, force_n: float, *, large: bool) -> MechanismState:
        mechanism = self.mechanism
        probes = {name: self._motion(moved, point) for name, point in mechanism.probes.items()}
        pairs = {}
        for name, (a, b) in mechanism.pairs.items():
            apart = np.array(mechanism.probes[b]) - mechanism.probes[a]
            pairs[name] = float(np.hypot(*(apart + np.array(probes[b]) - probes[a]))) if large else float(
                np.hypot(*apart) + (np.array(probes[b]) - probes[a]) @ apart / np.hypot(*apart))  # fmt: skip
        stress = self.plate.von_mises_mpa(moved, large=large)[:, self._in_flexure]
        return MechanismState(input_mm, force_n, probes, pairs, float(stress.max()), moved)

    def _motion(self, moved: Array, point: tuple[float, float]) -> tuple[float, float]:
        """Displacement of a point: a quadratic through the nearest nodes, as the elements have it."""
        x, y = self.plate.nodes_mm
        near = np.argsort(np.hypot(x - point[0], y - point[1]))[:12]
        around = np.column_stack([np.ones(near.size), x[near] - point[0], y[near] - point[1],
                                  (x[near] - point[0]) ** 2, (y[near] - point[1]) ** 2,
                                  (x[near] - point[0]) * (y[near] - point[1])])  # fmt: skip
        scale = np.abs(around).max(axis=0)
        found = [np.linalg.lstsq(around / scale, moved[dofs[near]], rcond=None)[0][0] / scale[0]
                 for dofs in (self.plate.x_dofs, self.plate.y_dofs)]  # fmt: skip
        return float(found[0]), float(found[1])

    def modes_hz(self, *, drive_held: bool, count: int = 3) -> tuple[float, ...]:
        """First natural frequencies in the plane, the drive held or free to move along its direction."""
        rad_s, _ = self.modes(drive_held=drive_held, count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array]:
        """First natural modes in the plane: angular frequencies in rad/s, and shapes of unit mass by column."""
        unknowns, free = self.plate.unknowns, self._free
        columns = identity(unknowns, format="csr")[:, free]
        if not drive_held:
            columns = hstack([columns, csr_matrix(self._by_input[:, None])], format="csr")
        K = (columns.T @ self.plate.stiffness_n_mm @ columns).tocsc()
        M = (columns.T @ self.plate.mass_t @ columns).tocsc()
        squared, shapes = eigsh(K, count, M, sigma=0.0, v0=np.ones(K.shape[0]))
        order = np.argsort(squared)
        return np.sqrt(squared[order]), np.asarray(columns @ shapes[:, order])

    def modal_model(self, count: int) -> ModalModel:
        """Reduce the mechanism to its static shape and its modes with the drive held; a pair is a length, see `state`.

        Parameters
        ----------
        count : int
            How many modes.
        """
        rad_s, shapes = self.modes(drive_held=True, count=count)
        static = self.unit_displacement_mm
        inertia = self.plate.mass_t @ static
        observed = {
            name: Observable(rest, float(change[0]), change[1:])
            for name, (rest, change) in self._observed(np.column_stack([static, shapes])).items()
        }
        return ModalModel(
            stiffness_n_mm=self.stiffness_n_mm,
            mass_t=float(static @ inertia),
            rad_s=rad_s,
            participation=shapes.T @ inertia,
            observed=observed,
        )

    def free_modes(self, count: int) -> FreeModes:
        """Return the modes with the drive free along its direction."""
        rad_s, shapes = self.modes(drive_held=False, count=count)
        drive = self._by_input @ shapes / (self._by_input @ self._by_input)
        return FreeModes(rad_s, drive, {name: change for name, (_, change) in self._observed(shapes).items()})

    def _observed(self, columns: Array) -> dict[str, tuple[float, Array]]:
        """Pairs, then probes: the length at rest, and its change by each column of displacements."""
        mechanism = self.mechanism
        moved = {name: np.array([self._motion(column, point) for column in columns.T])
                 for name, point in mechanism.probes.items()}  # fmt: skip
        observed = {}
        for name, (a, b) in mechanism.pairs.items():
            apart = np.array(mechanism.probes[b]) - mechanism.probes[a]
            observed[f"{name}_mm"] = float(np.hypot(*apart)), (moved[b] - moved[a]) @ apart / np.hypot(*apart)
        for name, ways in moved.items():
            for axis, way in zip("xy", ways.T, strict=True):
                observed[f"{name}_{axis}_mm"] = 0.0, way
        return observed

"""A planar mechanism by finite elements: any topology, small or large displacements, stress and natural modes."""

from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, hstack, identity
from scipy.sparse.linalg import LinearOperator, eigsh

from fingervision.domain.errors import ModelError
from fingervision.models.contact_pairs import contact_pair
from fingervision.models.driven_body import factorised
from fingervision.models.mechanism import Mechanism, check_mechanism
from fingervision.models.mechanism_bodies import LinkBody, bodies_of, plate_poses
from fingervision.models.mechanism_equilibrium import DrivenMechanism, MechanismEquilibrium
from fingervision.models.mechanism_faces import driven_components, mean_weights, per_input_of, supports_of, turns_with
from fingervision.models.mechanism_state import MechanismState, changes, observables, state_in_equilibrium
from fingervision.models.modal_model import FreeModes, ModalModel
from fingervision.models.planar_region import PlanarRegion, sharp_corners_mm
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.strip_energy import used_in_plate
from fingervision.models.triangulate import PlaneMesh, triangulate
from fingervision.models.width_effect import ConstrainedZone

Array = NDArray[np.float64]

_ACROSS, _BODY = 4.0, 0.025
"""Triangles across thin parts, and edge length over the body's size: as for the published sample."""
_STRESS_ERROR = 0.01
"""Relative error of the stress; meshes twice and three times as fine differ by 0.3 %
(`tests/benchmarks/models_held_out.py`)."""
_BESIDE_CORNER = 0.5
"""Distance from a sharp corner, in thicknesses of the thinnest flexure, within which stress is left out, because it
depends on the mesh there."""


class MechanismPlate:
    """Finite-element model of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    width_effect : bool
        Whether the restraint of the flexures by the plate's width is included; plane stress if False.
    refine : float
        Factor by which the edge lengths are divided.

    Raises
    ------
    FingervisionError
        If the drawing is not a valid mechanism, or a face contains no nodes of the outline.
    """

    kind = "finite_element"

    def __init__(self, mechanism: Mechanism, *, width_effect: bool = True, refine: float = 1.0) -> None:
        self.mechanism = mechanism
        region = mechanism.region
        check_mechanism(mechanism, region)
        self._size_mm = region.size_mm
        self.mesh: PlaneMesh = triangulate(region, _ACROSS * refine, _BODY * self._size_mm / refine)
        zones = self._hold_back(width_effect=width_effect)
        middles = self.mesh.nodes_mm[:, self.mesh.triangles[:3]].mean(axis=1)
        inside = [zone.holds(middles) for zone in zones] or [np.ones(middles.shape[1], dtype=bool)]
        self._in_flexure = np.any(inside, axis=0) & ~self._beside_sharp_corners(region, middles)
        self._support()
        if width_effect and any(not flexure.is_notch for flexure in mechanism.flexures) and not self._wanders():
            # The restraint of a strip by its width depends on how the strip is loaded, which is known only now.
            moved, whole = self.driven.unit_displacement, 0.5 * self.driven.input_stiffness_n_mm
            flexures = (f if f.is_notch else used_in_plate(f, self.plate, moved, whole) for f in mechanism.flexures)
            self.mechanism = replace(mechanism, flexures=tuple(flexures))
            del self.driven
            self._hold_back(width_effect=True)

    def _hold_back(self, *, width_effect: bool) -> tuple[ConstrainedZone, ...]:
        """Make the plate with its flexures stiffened by the restraint of its width."""
        mechanism = self.mechanism
        zones = tuple(flexure.zone(mechanism.plate_mm) for flexure in mechanism.flexures)
        used = zones if width_effect else ()
        self.plate = PlaneStressPlate(self.mesh, mechanism.material, mechanism.plate_mm, used)
        return zones

    def _beside_sharp_corners(self, region: PlanarRegion, points: Array) -> NDArray[np.bool_]:
        """Points within half a thickness of a sharp re-entrant corner, where the elastic stress is singular."""
        flexures = self.mechanism.flexures
        near_mm = _BESIDE_CORNER * min((flexure.thickness_mm for flexure in flexures), default=0.0)
        beside = np.zeros(points.shape[1], dtype=bool)
        for corner in sharp_corners_mm(region):
            beside |= np.hypot(points[0] - corner[0], points[1] - corner[1]) < near_mm
        return beside

    def _support(self) -> None:
        mechanism, plate = self.mechanism, self.plate
        supports = supports_of(plate, mechanism, self._size_mm)
        dofs = {"x": plate.x_dofs, "y": plate.y_dofs}
        held = [dofs[component][nodes] for nodes in supports.fixed for component in "xy"]
        held += [dofs[component][nodes] for nodes, component in supports.slides]
        self._by_drive = np.zeros((plate.unknowns, len(mechanism.drives)))
        motions = identity(plate.unknowns, format="csc")
        for column, (drive, nodes) in zip(self._by_drive.T, zip(mechanism.drives, supports.driven, strict=True),
                                          strict=True):  # fmt: skip
            driven = driven_components(drive)
            if len(driven) == 1 and turns_with(plate, nodes, driven[0]):
                # The face is parallel to the drive: the drive prescribes the mean motion of the face, through the
                # unknown with the largest weight.
                own, weights = dofs[driven[0]][nodes], mean_weights(plate, nodes)
                chief = int(np.argmax(weights))
                column[own[chief]] = drive.direction["xy".index(driven[0])] / weights[chief]
                motions = motions.tolil()
                motions[own[chief], own] = -weights / weights[chief]
                held.append(own[[chief]])
                continue
            for component, share in zip("xy", drive.direction, strict=True):
                if component in driven:
                    column[dofs[component][nodes]] = share
                    held.append(dofs[component][nodes])
        self._by_input = self._by_drive @ per_input_of(mechanism)
        free = np.setdiff1d(np.arange(plate.unknowns), np.concatenate(held))
        self._motions = csr_matrix(motions.tocsc()[:, free])

    @cached_property
    def driven(self) -> DrivenMechanism:
        """The mechanism as a system whose equilibria can be computed.

        Raises
        ------
        DataError, ModelError
            If a contact's face is not on the outline, or the supports allow the mechanism to move freely.
        """
        if self._wanders():
            raise ModelError(f"{self.mechanism.name} must be held by its fixed faces, but can move freely.")
        plate = self.plate
        pairs = [contact_pair(plate, contact, self.mechanism, self._size_mm) for contact in self.mechanism.contacts]
        return DrivenMechanism(
            self.mechanism.name, plate.internal_force_n, plate.nodal_force_n, self._motions, self._by_drive,
            per_input_of(self.mechanism), tuple(partial(pair.gaps_mm, plate) for pair in pairs),
        )  # fmt: skip

    def _wanders(self) -> bool:
        """Whether the supports allow a rigid motion of the whole mechanism."""
        x, y = self.plate.nodes_mm
        whole = np.zeros((3, self.plate.unknowns))
        whole[0, self.plate.x_dofs], whole[1, self.plate.y_dofs] = 1.0, 1.0
        whole[2, self.plate.x_dofs], whole[2, self.plate.y_dofs] = -(y - y.mean()), x - x.mean()
        held = np.flatnonzero(np.diff(self._motions.indptr) == 0)
        return bool(np.linalg.matrix_rank(whole[:, held] / np.abs(whole).max(axis=1)[:, None], tol=1e-6) < 3)

    @property
    def unit_displacement_mm(self) -> Array:
        """Small displacements per 1 mm of input."""
        return self.driven.unit_displacement

    @property
    def stiffness_n_mm(self) -> float:
        """Force at the drive per 1 mm of input, at rest (N/mm)."""
        return self.driven.input_stiffness_n_mm

    @property
    def force_error(self) -> float:
        """Relative error of the force, from the mesh and the width effect."""
        return 0.005 + self.mechanism.width_error

    @property
    def stress_error(self) -> float:
        """Relative error of the stress in the flexures, from the mesh."""
        return _STRESS_ERROR

    def touch_input_mm(self) -> dict[str, float]:
        """Input nearest to zero at which each contact first touches, in small displacements.

        Contacts that never touch are left out.
        """
        names = [contact.name for contact in self.mechanism.contacts]
        return {n: at for n, at in zip(names, self.driven.touch_inputs_mm(), strict=True) if at is not None}

    @cached_property
    def bodies(self) -> tuple[LinkBody, ...]:
        """The bodies that the flexures join."""
        return bodies_of(self.mechanism)

    def state(self, input_mm: float, *, large_rotation: bool = False, contact: bool = False) -> MechanismState:
        """Find the equilibrium at one input."""
        found = self.driven.equilibrium(input_mm, large_rotation=large_rotation, contact=contact)
        return self._seen(input_mm, found, large_rotation=large_rotation)

    def drive_states(self) -> tuple[MechanismState, ...]:
        """Small displacements per 1 mm of one driven face after another, with all other driven faces at rest."""
        return tuple(self._seen(1.0, found, large_rotation=False) for found in self.driven.by_one_drive())

    def _seen(self, input_mm: float, found: MechanismEquilibrium, *, large_rotation: bool) -> MechanismState:
        mechanism, moved = self.mechanism, found.displacement
        probes = {name: (float(rows[0] @ moved), float(rows[1] @ moved)) for name, rows in self.probe_rows.items()}
        stress = self.stress_mpa(moved, large=large_rotation)
        poses = plate_poses(self.plate, self.bodies, moved, large=large_rotation)
        return state_in_equilibrium(mechanism, input_mm, found, probes, stress, poses, large=large_rotation)

    def stress_mpa(self, moved: Array, *, large: bool = False) -> float:
        """Largest von Mises stress in the flexures at given displacements (MPa)."""
        return float(self.plate.von_mises_mpa(moved, large=large)[:, self._in_flexure].max())

    @cached_property
    def probe_rows(self) -> dict[str, Array]:
        """Matrices that convert displacements to the motion of every probe along x and y, shape (2, unknowns) each."""
        return {name: self.plate.rows_at(point) for name, point in self.mechanism.probes.items()}

    @cached_property
    def pair_rows(self) -> dict[str, Array]:
        """Vectors that convert small displacements to the change of each pair's distance, shape (unknowns,) each."""
        found = {}
        for name, (a, b) in self.mechanism.pairs.items():
            apart = np.array(self.mechanism.probes[b]) - self.mechanism.probes[a]
            found[name] = apart @ (self.probe_rows[b] - self.probe_rows[a]) / np.hypot(*apart)
        return found

    def modes_hz(self, *, drive_held: bool, count: int = 3) -> tuple[float, ...]:
        """First natural frequencies in the plane, with the drive fixed or free to move along its direction (Hz)."""
        rad_s, _, _ = self._modes(drive_held=drive_held, count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array]:
        """First natural modes in the plane: angular frequencies in rad/s, and mode shapes of unit mass by column."""
        return self._modes(drive_held=drive_held, count=count)[:2]

    def _modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array, Array]:
        """Angular frequencies, mode shapes, and the drive's motion in each mode."""
        columns = self._motions
        if not drive_held:
            columns = hstack([columns, csr_matrix(self._by_input[:, None])], format="csr")
        K = (columns.T @ self.plate.stiffness_n_mm @ columns).tocsc()
        M = (columns.T @ self.plate.mass_t @ columns).tocsc()
        inverse = LinearOperator(K.shape, factorised(K).solve, dtype=np.float64)
        squared, sought = eigsh(K, count, M, sigma=0.0, OPinv=inverse, v0=np.ones(K.shape[0]))
        order = np.argsort(squared)
        drive = np.zeros(count) if drive_held else sought[-1, order]
        return np.sqrt(squared[order]), np.asarray(columns @ sought[:, order]), drive

    def modal_model(self, count: int) -> ModalModel:
        """Reduce the mechanism to its static shape and its modes with the drive fixed.

        The observable of a pair of probes is their distance, see `state`.

        Parameters
        ----------
        count : int
            Number of modes.
        """
        rad_s, shapes = self.modes(drive_held=True, count=count)
        static = self.unit_displacement_mm
        inertia = self.plate.mass_t @ static
        return ModalModel(
            stiffness_n_mm=self.stiffness_n_mm,
            mass_t=float(static @ inertia),
            rad_s=rad_s,
            participation=shapes.T @ inertia,
            observed=observables(self.mechanism, self._probes_by(np.column_stack([static, shapes]))),
        )

    def free_modes(self, count: int) -> FreeModes:
        """Return the vibration modes with the drive free to move along its direction."""
        rad_s, shapes, drive = self._modes(drive_held=False, count=count)
        return FreeModes(rad_s, drive, changes(self.mechanism, self._probes_by(shapes)))

    def _probes_by(self, columns: Array) -> dict[str, Array]:
        """Small motion of every probe caused by each column of displacements, shape (2, k)."""
        return {name: rows @ columns for name, rows in self.probe_rows.items()}

    def mode_lines(self) -> tuple[Array, NDArray[np.int64]]:
        """Lines of the outline for plotting; see `mode_shapes.MovingMechanism`."""
        return self.plate.outline_lines()

"""Finite-element model of the gripper: its outline as a plane body (Hricko & Havlik (2015) used Comsol).

The plate is in plane stress; its hinges lie between plane stress and plane strain, depending on their width
(`width_effect`). For the published gripper in plane stress, a converged mesh gives 7.7212 mm of gap per millimetre of
input, a stiffness of 2.0014 N/mm and a stress of 19.07 MPa/mm; including the width of the hinges the stiffness is 2.06
N/mm, as with three-dimensional brick elements. The link length of the published gripper is unknown and was chosen so
that the slope equals the published slope of the Comsol model; the agreement of the two slopes is therefore no
validation.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property, partial
from math import nan

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, identity

from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import Gripper, PointMm
from fingervision.models.answer_figures import LINEAR, ModelFigures, Physics
from fingervision.models.elastic_mechanism import ElasticMechanism, LargestStress, changes
from fingervision.models.flexure_span import used_in_plate
from fingervision.models.flexure_stress import BESIDE_CORNER
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.gripper_model import DrawnGripper, ModelErrors
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.mechanism import Mechanism, check_mechanism
from fingervision.models.mechanism_bodies import BodyPose, plate_poses
from fingervision.models.mechanism_equilibrium import DrivenMechanism
from fingervision.models.mechanism_faces import (
    ContactPair,
    contact_pair,
    drive_weights,
    driven_components,
    moves_in_the_mean,
    per_input_of,
    supports_of,
    with_actuators,
)
from fingervision.models.out_of_plane import MODE_ERROR, SAG_ERROR, OutOfPlane, held_bodies, out_of_plane
from fingervision.models.planar_region import PlanarRegion, face_ends_mm, sharp_corners_mm
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.reference_mesh import mesh_of
from fingervision.models.triangulate import PlaneMesh, triangulate
from fingervision.models.width_effect import ConstrainedZone, force_uncertainty

# A planar mechanism by finite elements: any topology, small or large displacements, stress and natural modes.

Array = NDArray[np.float64]

_ACROSS, _BODY = 4.0, 0.025
"""Triangles across thin parts, and edge length over the body's size: as for the published sample."""
_STRESS_ERROR = 0.01
"""Relative error of the stress; meshes twice and three times as fine differ by 0.3 %
(`tests/benchmarks/models_held_out.py`)."""
_BESIDE_END = 0.03
"""Distance from the end of a face, over the body's size, within which the largest stress is that of the end, where it
has no limit: with a clamp or a held drive there it was twice that of wedge elements of CalculiX."""
_BUCKLING = 4
"""Number of buckling inputs nearest to rest that are sought on both sides together."""


class MechanismPlate(ElasticMechanism):
    """Finite-element model of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    width_effect : bool
        Whether the restraint of the flexures by the plate's width is included; plane stress if False.
    refine : float
        Factor by which the edge lengths are divided.
    mesh : PlaneMesh or None
        Triangles of the drawing; None makes them.

    Raises
    ------
    FingervisionError
        If the drawing is not a valid mechanism, or a face contains no nodes of the outline.
    """

    kind = "finite_element"

    def __init__(
        self, mechanism: Mechanism, *, width_effect: bool = True, refine: float = 1.0, mesh: PlaneMesh | None = None
    ) -> None:
        super().__init__(mechanism)
        self._width_effect = width_effect
        if mechanism.layers:
            raise ModelError(
                f"{mechanism.name} has several layers, but finite elements mesh one: take --kind lumped or "
                "stiffness_matrix."
            )
        region = mechanism.region
        check_mechanism(mechanism, region)
        self._size_mm = region.size_mm
        self.mesh: PlaneMesh = mesh or triangulate(region, _ACROSS * refine, _BODY * self._size_mm / refine)
        zones = self._hold_back()
        middles = self.plate.middles_mm
        inside = [zone.holds(middles) for zone in zones] or [np.ones(middles.shape[1], dtype=bool)]
        corners_mm = self.plate.nodes_mm[:, self.plate.corner_triangles]
        self._in_flexure = np.any(inside, axis=0) & ~self._beside_sharp_corners(region, corners_mm)
        corners = [] if mechanism.flexures else sharp_corners_mm(region)
        self.unstated_stress_at_mm = (float(corners[0][0]), float(corners[0][1])) if corners else None
        self._support()
        if width_effect and mechanism.drives and not self._wanders():
            # The restraint of a strip by its width depends on how the strip is loaded, which is known only now.
            moved = self.driven.unit_displacement
            whole = float(self.plate.energies_n_mm(moved).sum())
            flexures = tuple(
                f if f.is_notch else used_in_plate(f, self.plate, moved, whole) for f in mechanism.flexures
            )
            bodies = held_bodies(self.plate, mechanism, moved, whole, self._errors[0])
            if (flexures, bodies) != (mechanism.flexures, mechanism.held_bodies):
                self.mechanism = replace(mechanism, flexures=flexures, held_bodies=bodies)
                del self.driven
                self._hold_back()
            if not flexures and self.unstated_stress_at_mm is None:
                at_mm = self.peak_stress(moved).place_mm
                ends = [end for end in face_ends_mm(region) if np.hypot(*(end - at_mm)) < _BESIDE_END * self._size_mm]
                self.unstated_stress_at_mm = at_mm if ends else None

    def _hold_back(self) -> tuple[ConstrainedZone, ...]:
        """Make the plate with its flexures stiffened by the restraint of its width; equal halves are one plate."""
        mechanism = self.mechanism
        zones = tuple(flexure.zone(mechanism.plate_mm) for flexure in mechanism.flexures)
        used, bodies = (zones, mechanism.held_bodies) if self._width_effect else ((), None)
        thick_mm = mechanism.halves * mechanism.plate_mm
        self.plate = PlaneStressPlate(self.mesh, mechanism.material, thick_mm, used, bodies=bodies)
        return zones

    def _beside_sharp_corners(self, region: PlanarRegion, points: Array) -> NDArray[np.bool_]:
        """Points within half a thickness of a sharp re-entrant corner, where the elastic stress is singular."""
        flexures = self.mechanism.flexures
        near_mm = BESIDE_CORNER * min((flexure.thickness_mm for flexure in flexures), default=0.0)
        beside = np.zeros(points.shape[1:], dtype=bool)
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
        self._drive_rows = np.zeros_like(self._by_drive)
        motions = identity(plate.unknowns, format="csc")
        for place, (drive, nodes) in enumerate(zip(mechanism.drives, supports.driven, strict=True)):
            column, own_row = self._by_drive[:, place], self._drive_rows[:, place]
            driven = driven_components(drive)
            main = int(np.argmax(np.abs(drive.direction)))
            own_row[dofs["xy"[main]][nodes]] = drive_weights(plate, nodes, drive.face) / drive.direction[main]
            if moves_in_the_mean(plate, nodes, drive):
                weights = drive_weights(plate, nodes, drive.face)
                wanted = [(c, weights, drive.direction["xy".index(c)]) for c in driven]
                if drive.turns == "held":
                    across = "yx"["xy".index(driven[0])]
                    along = plate.nodes_mm["xy".index(driven[0]), nodes]
                    wanted.append((across, weights * (along - weights @ along), 0.0))
                motions = motions.tolil()
                for component, row, value in wanted:
                    # The drive prescribes a weighted sum, through the unknown with the largest weight that can move.
                    own = dofs[component][nodes]
                    chief = int(np.argmax(np.where(np.isin(own, np.concatenate([*held, [-1]])), 0.0, np.abs(row))))
                    column[own[chief]] = value / row[chief]
                    motions[own[chief], own] = -row / row[chief]
                    held.append(own[[chief]])
                continue
            for component, share in zip("xy", drive.direction, strict=True):
                if component in driven:
                    column[dofs[component][nodes]] = share
                    held.append(dofs[component][nodes])
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
        system = DrivenMechanism(
            self.mechanism.name, plate.internal_force_n, plate.nodal_force_n, self._motions, self._by_drive,
            per_input_of(self.mechanism), lambda: plate.mass_t,
            tuple(partial(pair.gaps_mm, plate) for pair in self._pairs),
        )  # fmt: skip
        return with_actuators(system, self._drive_rows, self.mechanism)

    def buckling_inputs_mm(self) -> Array:
        """Inputs on either side of rest at which a flexure buckles in the plane, in rising order (mm).

        By linear theory, the stiffness and u times the geometric stiffness per 1 mm of input are singular there (Bonet
        and Wood, as for `PlaneStressPlate.internal_force_n`). An input is infinite if there is none, or if all that are
        sought are on the other side of rest.
        """
        system = self.driven
        geometric = self.plate.geometric_stiffness_n_mm(system.unit_displacement)
        found = system.eigenvalues(geometric, _BUCKLING)
        low, high = min(found), max(found)
        return np.array([-1.0 / high if high > 0.0 else -np.inf, -1.0 / low if low < 0.0 else np.inf])

    def _wanders(self) -> bool:
        """Whether the supports allow a rigid motion of the whole mechanism."""
        x, y = self.plate.nodes_mm
        whole = np.zeros((3, self.plate.unknowns))
        whole[0, self.plate.x_dofs], whole[1, self.plate.y_dofs] = 1.0, 1.0
        whole[2, self.plate.x_dofs], whole[2, self.plate.y_dofs] = -(y - y.mean()), x - x.mean()
        held = np.flatnonzero(np.diff(self._motions.indptr) == 0)
        return bool(np.linalg.matrix_rank(whole[:, held] / np.abs(whole).max(axis=1)[:, None], tol=1e-6) < 3)

    @cached_property
    def _pairs(self) -> tuple[ContactPair, ...]:
        mechanism = self.mechanism
        return tuple(contact_pair(self.plate, contact, mechanism, self._size_mm) for contact in mechanism.contacts)

    @property
    def contact_points_mm(self) -> tuple[Array, ...]:
        """Nodes of every contact's face, shape (2, k) each."""
        return tuple(self.plate.nodes_mm[:, pair.nodes] for pair in self._pairs)

    @property
    def in_plane_stress(self) -> "MechanismPlate":
        """The same mesh without the restraint of the flexures by the plate's width."""
        return MechanismPlate(self.mechanism, width_effect=False, mesh=self.mesh)

    @cached_property
    def swaying(self) -> "MechanismPlate":
        """The half of a mirrored drawing whose other half moves the same way sideways."""
        return MechanismPlate(self.mechanism.swaying, width_effect=self._width_effect, mesh=self.mesh)

    @property
    def _errors(self) -> tuple[float, float]:
        return _FORCE_ERROR + self.mechanism.width_error, _STRESS_ERROR + self.mechanism.stress_error

    def drawn_poses(self, moved: Array, *, large: bool) -> Mapping[str, BodyPose]:
        """Poses of the drawn bodies."""
        return plate_poses(self.plate, self.bodies, moved, large=large)

    def motion_mm(self, moved: Array, point: PointMm, *, large: bool) -> Array:
        """Displacement of the point of the finite element in which it lies; linear in the nodes' displacements."""
        del large
        return np.asarray(self._rows_at(point) @ moved)

    def _rows_at(self, point: PointMm) -> Array:
        if point not in self._rows:
            self._rows[point] = self.plate.rows_at(point)
        return self._rows[point]

    @cached_property
    def _rows(self) -> dict[PointMm, Array]:
        return {}

    def pulled(self, direction: PointMm, system: DrivenMechanism) -> Array:
        """Displacements of a rigid translation."""
        moved = np.zeros(system.unknowns)
        moved[self.plate.x_dofs], moved[self.plate.y_dofs] = direction
        return moved

    def peak_stress(self, moved: Array, *, large: bool = False) -> LargestStress:
        """Largest von Mises stress in the flexures at given displacements.

        It is not a number in a drawing without flexures that has a re-entrant corner without a radius, or whose stress
        is largest at the end of a face (`unstated_stress_at_mm`): the stress has no limit there.
        """
        if self.unstated_stress_at_mm is not None:
            return LargestStress(nan, self.unstated_stress_at_mm)
        rest_mm = self.driven.rest_mm
        found = self.plate.von_mises_mpa(moved, large=large, rest_mm=rest_mm if np.any(rest_mm) else None)
        stress = np.where(self._in_flexure, found, 0.0)
        place = np.unravel_index(np.argmax(stress), stress.shape)
        x, y = self.plate.nodes_mm[:, self.plate.corner_triangles[place]]
        return LargestStress(float(stress[place]), (float(x), float(y)))

    @cached_property
    def probe_rows(self) -> dict[str, Array]:
        """Matrices that convert displacements to the motion of every probe along x and y, shape (2, unknowns) each."""
        return self._of_probes(self._rows_at)

    @cached_property
    def pair_rows(self) -> dict[str, Array]:
        """Vectors that convert small displacements to the change of each pair's distance, shape (unknowns,) each."""
        rows = changes(self.mechanism, self.probe_rows)
        return {name: rows[f"{name}_mm"] for name in self.mechanism.pairs}

    def mode_lines(self) -> tuple[Array, NDArray[np.int64]]:
        """Lines of the outline for plotting."""
        return self.plate.outline_lines()


KIND = "finite_element"
TRUST, WHY_TRUSTED = (
    3,
    "it models the outline itself, whereas the other model replaces the body by bars and notches joined at points",
)

_SLOPE_ERROR, _FORCE_ERROR, _MODE_ERROR = 0.001, 0.005, 0.01
"""Relative errors of the mesh, estimated from finer meshes and published values
(`tests/benchmarks/models_held_out.py`)."""


class FiniteElementGripper(DrawnGripper):
    """A meshed gripper with two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included.
    mesh : PlaneMesh or None
        Triangles of the right half; None loads the packaged mesh for the reference outline and makes a new mesh for
        others.
    width_effect : bool
        Whether the constraint of the hinges by the plate's width is included; if False, plane stress holds everywhere.

    Raises
    ------
    FingervisionError
        If the gripper cannot be meshed, or its body does not reach the clamp, the symmetry axis or the drive.
    """

    name = KIND

    def __init__(
        self, gripper: Gripper, physics: Physics = LINEAR, mesh: PlaneMesh | None = None, *, width_effect: bool = True
    ) -> None:
        self.plane = MechanismPlate(half_mechanism(gripper), mesh=mesh or mesh_of(gripper), width_effect=width_effect)
        width = force_uncertainty(gripper.material)
        force = _FORCE_ERROR + 2.0 * width
        super().__init__(gripper, physics, self.plane, ModelErrors(_SLOPE_ERROR, force, _MODE_ERROR + width, force))

    @property
    def mesh(self) -> PlaneMesh:
        """Triangles of the right half."""
        return self.plane.mesh

    @property
    def plate(self) -> PlaneStressPlate:
        """The meshed right half, as thick as both halves."""
        return self.plane.plate

    @cached_property
    def across_plane(self) -> OutOfPlane:
        """First mode and sag out of the plane, with the drive fixed, computed in three dimensions (`out_of_plane`)."""
        return out_of_plane(self.plane.mechanism)

    def figures(self) -> ModelFigures:
        """Characteristic numbers of the model for the comparison table."""
        return replace(
            super().figures(),
            out_of_plane_modes_hz=self.across_plane.modes_hz,
            sag_out_of_plane_mm=self.across_plane.sag_mm["right tip"],
            out_of_plane_error=MODE_ERROR,
            sag_error=SAG_ERROR,
        )


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> FiniteElementGripper:
    """Build the model; see `fingervision.models.kinds`."""
    del theory  # `theory` is not used: the compliance of the hinges follows from the outline
    return FiniteElementGripper(gripper, physics)

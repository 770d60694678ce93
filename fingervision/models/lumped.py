"""The gripper as lumped flexures between elastic bodies, after the SimMechanics model of Hricko & Havlik (2015)."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, identity

from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import Gripper, PointMm
from fingervision.models.answer_figures import LINEAR, Physics
from fingervision.models.body_assembly import SegmentMass, assemble_bodies, frame_vibration
from fingervision.models.condensed_bodies import OwnModes
from fingervision.models.corotational_frame import CorotationalFrame, turned_axes
from fingervision.models.elastic_mechanism import ElasticMechanism, LargestStress
from fingervision.models.flexure_span import FlexureSpan, span_of, used_in_frame
from fingervision.models.flexure_stress import nominal_stress
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.gripper_model import DrawnGripper, ModelErrors
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.layers import layers_at, plan_of
from fingervision.models.mechanism import Mechanism, check_mechanism
from fingervision.models.mechanism_bodies import BodyPose, plate_poses
from fingervision.models.mechanism_equilibrium import DrivenMechanism, Gaps
from fingervision.models.mechanism_faces import (
    ContactNodes,
    ContactPair,
    contact_pair,
    per_input_of,
    with_actuators,
)
from fingervision.models.out_of_plane import held_bodies
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.stiffness_matrix import ERRORS_OF_BARS
from fingervision.models.triangulate import PlaneMesh, triangulate
from fingervision.models.width_effect import force_uncertainty

# A planar mechanism of lumped flexures between elastic bodies: any topology, loops included.
#
# The model is the lumped model of Hricko & Havlik (2015), extended to any drawing. Flexures are chains of beam
# segments, corrected by the hinge tables; the bodies that they join are cut from the drawing and condensed to a few
# coordinate frames (`condensed_bodies`). Flexures and bodies may rotate by any angle.

Array = NDArray[np.float64]

# Share of a notch flexure's strain energy that is not in the intended deformation, bending of its neck.


def misused_energy(span: FlexureSpan, end_loads: Array, compliances: Array, plate_mm: float) -> tuple[float, float]:
    """Strain energy of a flexure outside its intended deformation, and the flexure's total strain energy (N mm).

    Parameters
    ----------
    span : FlexureSpan
        The flexure.
    end_loads : ndarray of float, shape (segments, 3)
        Tension in N and moments in N mm at both ends of every segment, as returned by `CorotationalFrame.end_loads`.
    compliances : ndarray of float, shape (segments, 3, 3)
        Compliance of each segment at its end.
    plate_mm : float
        Thickness of the plate.
    """
    stations = span.stations_mm(plate_mm)
    tension, first, second = end_loads.T
    shear = -(first + second) / np.diff(stations)
    loads = np.column_stack([tension, shear, second])
    whole = 0.5 * float(np.einsum("mi,mij,mj->", loads, compliances, loads))
    if not span.flexure.is_notch:  # a leaf bends as a beam in every direction
        return 0.0, whole
    at_neck = float(np.interp(0.0, stations, np.append(-first, second[-1])))
    bent = 0.5 * at_neck**2 * float(np.sum(compliances[:, 2, 2]))
    return max(whole - bent, 0.0), whole


_ACROSS, _BODY = 2.0, 0.05
"""Triangles across thin parts, and edge length over the body's size: the mesh is coarse because bodies deform little,
and their stress is not computed."""
_TINY = 1e-7
_RIGID_MOTIONS, _SAME_PLACE = 3, 1e-6
"""Number of rigid motions in the plane, and the share of the size below which a lever arm prevents no rotation."""
_FORCE_ERROR = 0.015
"""Relative error of the force from the tables of hinges between blocks, by comparison with finite elements
(`tests/benchmarks/models_held_out.py`)."""
_STRESS_ONE_SIDED = 0.04
"""Relative error of the stress at a strip's fillets, which may be on one side of the strip only
(`tests/models/test_strips.py`): the factors are those of fillets on both sides."""
_FORCE_MISUSED, _STRESS_ERROR, _STRESS_MISUSED = 0.05, 0.02, 0.3
"""Relative errors of force and stress where a guided drive shears or stretches flexures instead of bending them. Forces
across a notch are within 1 % of those in plane stress; forces along a notch are up to 4 % too low or too high (elliptic
cuts, wide plates). The stress is too low by 0.3 sqrt(t / R), because its peak is no longer at the neck."""
_ONE_SIDED = 0.07
"""Relative error of the force because a notch is cut from one side only: its beam, a notch of half the depth on both
sides, is 1 to 6.5 % too stiff for t / R of 0.025 to 0.4 (`tests/models/test_found_notches.py`)."""
_ROOT_IN_LAYERS = 1.2
"""Relative error of the force, over thickness / length of a leaf, because a body of several layers yields at the leaf's
root as if the leaf were as wide: two stages on such a ground are 0.6 t / L stiffer than each on its own, for one root
(`tests/models/test_layers.py`)."""
_TINIEST = 1e-300
_LEAST_OWN = 3
"""Own modes of every body with which its first mode is computed."""


class MechanismFrame(ElasticMechanism):
    """Lumped model of a mechanism: flexures as beams between condensed elastic bodies.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    width_effect : bool
        Whether the restraint of the flexures by the plate's width is included; plane stress if False.
    theory : HingeTheory
        Theory of the notches' compliance.
    mesh : PlaneMesh or None
        Triangles of the bodies without the flexures; None makes them.

    Raises
    ------
    FingervisionError
        If the drawing is not a valid mechanism, has no flexure, or a flexure does not join two bodies.
    """

    kind = "lumped"

    def __init__(
        self,
        mechanism: Mechanism,
        *,
        width_effect: bool = True,
        theory: HingeTheory = HingeTheory.CORRECTED,
        mesh: PlaneMesh | None = None,
    ) -> None:
        super().__init__(mechanism)
        self.theory, self._width_effect = theory, width_effect
        region = mechanism.region
        check_mechanism(mechanism, region)
        if not mechanism.flexures:
            raise ModelError(
                f"{mechanism.name} must have flexures to be a lumped model, but has none; take --kind finite_element."
            )
        by_layer = mechanism.by_layer
        self.spans = tuple(span_of(flexure, by_layer[flexure.layer]) for flexure in mechanism.flexures)
        for drive in mechanism.drives:
            middle = np.array(drive.face.middle_mm)[:, None]
            on = [span.flexure.name for span in self.spans if drive.face.is_pin and span.slab.holds(middle)[0]]
            if on:
                raise ModelError(
                    f"pin {drive.face.name} of {mechanism.name} must lie on a body to be driven in a lumped model, but "
                    f"lies on flexure {on[0]}; take --kind finite_element."
                )
        self._size_mm = region.size_mm
        self._layers: tuple[Array | None, NDArray[np.int64] | None] = (None, None)
        if mechanism.layers:
            self._mesh, self._layers = self._meshed_in_layers(region)
        else:
            cut = PlanarRegion((*region.steps, *((False, span.slab) for span in self.spans)), region.marks_mm)
            self._mesh = mesh or triangulate(cut, _ACROSS, _BODY * region.size_mm)
        self._assemble()
        if width_effect and mechanism.drives:
            # The restraint of a strip by its width depends on how the strip is loaded, which is known only now.
            loads, field = self._unit_loads(), self._field(self.driven.unit_displacement, large=False)
            whole = float(self.plate.energies_n_mm(field).sum()) + sum(own for _, own in self._energies(loads))
            self.spans = tuple(
                span
                if span.flexure.is_notch
                else replace(span, flexure=used_in_frame(span, loads[list(own)], self.plate, whole))
                for span, own in zip(self.spans, self.segments, strict=True)
            )
            bodies = held_bodies(self.plate, mechanism, field, whole, _FORCE_ERROR + mechanism.width_error)
            flexures = tuple(span.flexure for span in self.spans)
            if (flexures, bodies) != (mechanism.flexures, mechanism.held_bodies):
                self.mechanism = replace(mechanism, flexures=flexures, held_bodies=bodies)
                del self.driven
                self._assemble()

    def _meshed_in_layers(self, region: PlanarRegion) -> tuple[PlaneMesh, tuple[Array, NDArray[np.int64]]]:
        """Triangles of all bodies, each alone, with the number of layers and of the body at every triangle."""
        nodes: list[Array] = []
        triangles, layers = [], []
        for body in self.bodies:
            mesh = triangulate(plan_of(body.sheets, region.marks_mm), _ACROSS, _BODY * region.size_mm)
            triangles.append(mesh.triangles + sum(part.shape[1] for part in nodes))
            nodes.append(mesh.nodes_mm)
            corners = mesh.nodes_mm[:, mesh.triangles[:3]]
            layers.append(layers_at(body.sheets, self.mechanism.joints, corners, self.mechanism.name))
        sizes = [part.size for part in layers]
        whole = PlaneMesh(np.concatenate(nodes, axis=1), np.concatenate(triangles, axis=1))
        return whole, (np.concatenate(layers), np.repeat(np.arange(len(sizes)), sizes))

    def _assemble(self) -> None:
        mechanism = self.mechanism
        zones = tuple(f.zone(mechanism.plate_mm) for f in mechanism.flexures if not f.is_notch)
        used, bodies = (zones, mechanism.held_bodies) if self._width_effect else ((), None)
        thick_mm = mechanism.halves * mechanism.plate_mm
        self.plate = PlaneStressPlate(self._mesh, mechanism.material, thick_mm, used, *self._layers, bodies=bodies)
        self.assembly = assemble_bodies(self.plate, mechanism, self.spans, self._size_mm)
        self._make_flexures()

    def _make_flexures(self) -> None:
        mechanism, assembly = self.mechanism, self.assembly
        places = [frame.at_mm for frame in assembly.frames]
        ends: list[tuple[int, int]] = []
        compliances: list[Array] = []
        self.segments: list[range] = []
        self._masses: list[SegmentMass] = []
        self._vibrating: dict[int, tuple[tuple[OwnModes, ...], DrivenMechanism]] = {}
        for span, (first, last) in zip(self.spans, assembly.ends, strict=True):
            stations = span.stations_mm(mechanism.plate_mm)
            nodes = [first, *range(len(places), len(places) + len(stations) - 2), last]
            places += [np.array(span.flexure.section_mm(x)) for x in stations[1:-1].tolist()]
            self.segments.append(range(len(ends), len(ends) + len(stations) - 1))
            own = list(pairwise(nodes))
            ends += own
            one = span.compliances(mechanism.plate_mm, mechanism.material, self.theory, width_effect=self._width_effect)
            compliances += list(one / mechanism.halves)
            weight = mechanism.material.density_t_mm3 * self.plate.plate_mm
            lengths = np.diff(stations)
            masses = weight * lengths * span.flexure.height_mm(0.5 * (stations[1:] + stations[:-1]))
            self._masses += list(map(SegmentMass, own, masses.tolist(), lengths.tolist()))
        self.frame = CorotationalFrame(np.array(places), np.array(ends), np.array(compliances))
        prescribed = [place for moved in assembly.by_drive for place in moved]
        self.by_drive = np.zeros((self.frame.unknowns, len(assembly.by_drive)))
        for column, moved in enumerate(assembly.by_drive):
            self.by_drive[list(moved), column] = list(moved.values())
        self.by_input = self.by_drive @ per_input_of(mechanism)
        self.free = np.setdiff1d(np.arange(self.frame.unknowns), [*assembly.held, *prescribed])

    def _tangent(self, moved: Array) -> tuple[csr_matrix, Array]:
        tangent, force = self.frame.internal_force_n(moved)
        rows, columns, values = [], [], []
        for body, turning in zip(self.assembly.bodies, self.assembly.turning, strict=True):
            dofs = body.unknowns
            stiffness, forces = turning.forces_n(moved[dofs])
            rows.append(np.repeat(dofs, dofs.size))
            columns.append(np.tile(dofs, dofs.size))
            values.append(stiffness.ravel())
            force[dofs] += forces
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return csr_matrix(tangent + coo_matrix(entries, shape=tangent.shape)), force

    @cached_property
    def driven(self) -> DrivenMechanism:
        """The mechanism as a system whose equilibria can be computed.

        Raises
        ------
        ModelError
            If the supports allow the whole mechanism to move freely.
        """
        x, y = (self.frame.nodes_mm - self.frame.nodes_mm.mean(axis=0)).T / self._size_mm
        zero, one = np.zeros_like(x), np.ones_like(x)
        whole = np.stack([[one, zero, zero], [zero, one, zero], [-y, x, one / self._size_mm]]).transpose(0, 2, 1)
        held = np.setdiff1d(np.arange(self.frame.unknowns), self.free)
        if np.linalg.matrix_rank(whole.reshape(3, -1)[:, held], tol=_SAME_PLACE) < _RIGID_MOTIONS:
            raise ModelError(f"{self.mechanism.name} must be held by its fixed faces, but can move freely.")
        every = identity(self.frame.unknowns, format="csc")
        system = DrivenMechanism(
            self.mechanism.name, self._tangent, lambda moved: self._tangent(moved)[1], csr_matrix(every[:, self.free]),
            self.by_drive, per_input_of(self.mechanism), self._no_mass,
            tuple(self._gaps_of(*ends) for ends in self._contact_ends),
        )  # fmt: skip
        # A face's motion is that of its coordinate frame, in the component in which the drive moves it most.
        main = np.argmax(np.abs(self.by_drive), axis=0)
        rows, drives = np.zeros_like(self.by_drive), np.arange(main.size)
        rows[main, drives] = 1.0 / self.by_drive[main, drives]
        return with_actuators(system, rows, self.mechanism)

    def _no_mass(self) -> csr_matrix:
        raise NotImplementedError("The frames' masses need the bodies' own modes: see `vibrating`.")

    @cached_property
    def _contact_ends(self) -> tuple[tuple[ContactNodes, ContactPair], ...]:
        """The nodes of every contact; of its first face, the two that are farthest apart."""
        found = []
        for contact in self.mechanism.contacts:
            pair = contact_pair(self.plate, contact, self.mechanism, self._size_mm)
            places = self.plate.nodes_mm[:, pair.nodes]
            first = int(np.argmax(np.hypot(*(places - places[:, :1]))))
            second = int(np.argmax(np.hypot(*(places - places[:, [first]]))))
            found.append(replace(pair, nodes=pair.nodes[[first, second]]).alone(self.plate))
        return tuple(found)

    @property
    def contact_points_mm(self) -> tuple[Array, ...]:
        """The two nodes of every contact's face that are farthest apart, shape (2, 2) each."""
        return tuple(nodes.nodes_mm[:, pair.nodes] for nodes, pair in self._contact_ends)

    def _gaps_of(self, nodes: ContactNodes, pair: ContactPair) -> Callable[[Array], Gaps]:
        """Return a function that gives the gaps of a contact at the two ends of its face."""

        def gaps(moved: Array) -> Gaps:
            field, slope = self.assembly.field(moved, nodes.places)
            gap, by_node, bend = pair.gaps_mm(nodes, field)
            # The second derivative leaves out the rotation of the frames, which makes Newton's method a little slower.
            return gap, csr_matrix(by_node @ slope), lambda forces: csr_matrix(slope.T @ bend(forces) @ slope)

        return gaps

    @cached_property
    def _errors(self) -> tuple[float, float]:
        """Relative errors of force and stress: as for flexures in bending, and larger for other loads on flexures."""
        loads, plate_mm = self._unit_loads(), self.mechanism.plate_mm
        misused, every, stress = 0.0, 0.0, 0.0
        for span, (part, whole) in zip(self.spans, self._energies(loads), strict=True):
            misused, every = misused + part, every + whole
            if span.flexure.is_notch:
                ratio = min(span.notch(plate_mm).curvature_ratio, 1.0)
                stress = max(stress, _STRESS_MISUSED * sqrt(ratio) * part / max(whole, _TINIEST))
            elif span.flexure.kind == "strip" and span.flexure.fillet_mm:
                stress = max(stress, _STRESS_ONE_SIDED)
        force, stress = _FORCE_ERROR + self.mechanism.width_error, stress + self.mechanism.stress_error
        force += _ONE_SIDED * any(span.flexure.lean for span in self.spans)
        if self.mechanism.layers:
            leaves = [span.flexure for span in self.spans if not span.flexure.is_notch]
            force += _ROOT_IN_LAYERS * max((leaf.thickness_mm / leaf.bent_mm for leaf in leaves), default=0.0)
        return force + _FORCE_MISUSED * misused / max(every, _TINIEST), _STRESS_ERROR + stress

    def _energies(self, loads: Array) -> list[tuple[float, float]]:
        """Strain energy of every flexure outside its intended deformation, and its total strain energy (N mm)."""
        found = zip(self.spans, map(list, self.segments), strict=True)
        plate_mm, each = self.mechanism.plate_mm, self.frame.end_compliance
        return [misused_energy(span, loads[own], each[own], plate_mm) for span, own in found]

    def _end_loads(self, moved: Array, *, large: bool) -> Array:
        """Tension and end moments of all segments of the flexures.

        For small displacements the segments' axes rotate no further than the preload has rotated them: the loads are
        computed for a tiny fraction of what is added to the shape at rest, and scaled up.
        """
        if large:
            return np.asarray(self.frame.end_loads(moved))
        rest_mm = self.driven.rest_mm
        at_rest = self.frame.end_loads(rest_mm) if np.any(rest_mm) else 0.0
        added = moved - rest_mm
        share = _TINY * self._size_mm / max(float(np.abs(added).max()), _TINY)
        return np.asarray(at_rest + (self.frame.end_loads(rest_mm + share * added) - at_rest) / share)

    def _unit_loads(self) -> Array:
        """What 1 mm of input adds to the end loads."""
        rest_mm, unit = self.driven.rest_mm, self.driven.unit_displacement
        return self._end_loads(rest_mm + unit, large=False) - self._end_loads(rest_mm + 0.0 * unit, large=False)

    @property
    def in_plane_stress(self) -> "MechanismFrame":
        """The same mechanism without the restraint of the flexures by the plate's width."""
        return MechanismFrame(self.mechanism, width_effect=False, theory=self.theory, mesh=self._mesh)

    @cached_property
    def swaying(self) -> "MechanismFrame":
        """The half of a mirrored drawing whose other half moves the same way sideways."""
        return MechanismFrame(
            self.mechanism.swaying, width_effect=self._width_effect, theory=self.theory, mesh=self._mesh
        )

    def peak_stress(self, moved: Array, *, large: bool = False) -> LargestStress:
        """Largest nominal stress in the flexures, with the factors of a notch or of fillets."""
        loads, mechanism = self._end_loads(moved, large=large) / self.mechanism.halves, self.mechanism
        found = (
            nominal_stress(span, loads[list(own)], mechanism, self.theory, width_effect=self._width_effect)
            for span, own in zip(self.spans, self.segments, strict=True)
        )
        return max(found, key=lambda peak: peak.mpa)

    def drawn_poses(self, moved: Array, *, large: bool) -> Mapping[str, BodyPose]:
        """Poses of the drawn bodies."""
        return plate_poses(self.plate, self.bodies, self._field(moved, large=large), large=large)

    def pulled(self, direction: PointMm, system: DrivenMechanism) -> Array:
        """Displacements of a rigid translation: every frame moves, no body vibrates."""
        moved = np.zeros(system.unknowns)
        moved[0 : self.frame.unknowns : 3], moved[1 : self.frame.unknowns : 3] = direction
        return moved

    def _field(self, moved: Array, *, large: bool) -> Array:
        """Displacement of every node of the bodies; small displacements may include the bodies' own modes."""
        if large:
            return self.assembly.field(moved, np.arange(self.plate.x_dofs.size))[0]
        return self.assembly.small_field(moved, self._own_of(moved))

    def _own_of(self, moved: Array) -> tuple[OwnModes, ...]:
        """Own modes of the bodies whose coordinates follow the frames' motions, if there are such coordinates."""
        return next(iter(self._vibrating.values()))[0] if moved.shape[0] > self.frame.unknowns else ()

    def motion_mm(self, moved: Array, point: PointMm, *, large: bool) -> Array:
        """Displacement of a point of a body; a point on a flexure moves with the nearest section of it."""
        node = self._section_at(point)
        if node is None:
            return self.assembly.motion_mm(moved, point, self._own_of(moved), large=large)
        x, y, angle = (moved[3 * node + way] for way in range(3))
        arm = np.array(point) - self.frame.nodes_mm[node]
        if large:
            return np.asarray(np.array([x, y]) + (turned_axes(float(angle)) - np.eye(2)) @ arm)
        return np.stack([x - angle * arm[1], y + angle * arm[0]])

    def _section_at(self, point: PointMm) -> int | None:
        """Node of the section of a flexure that is nearest to a point on the flexure; None for a point on a body."""
        for span, own in zip(self.spans, self.segments, strict=True):
            if span.slab.holds(np.array(point)[:, None])[0]:
                nodes = np.unique(self.frame.ends[list(own)])
                return int(nodes[np.argmin(np.hypot(*(self.frame.nodes_mm[nodes] - point).T))])
        return None

    def vibrating(self, count: int) -> DrivenMechanism:
        """Return the system with masses and as many own modes of every body; without own modes for a count of 0."""
        own = max(count, _LEAST_OWN) if count else 0
        if own not in self._vibrating:  # the latest number is kept
            self._vibrating = {own: frame_vibration(self.assembly, self.driven, self._masses, own)}
        return self._vibrating[own][1]

    def line_motions(self, shapes: Array) -> Array:
        """Displacements of the bodies' nodes, followed by the motions of the coordinate frames."""
        return np.vstack([self._field(shapes, large=False), shapes[: self.frame.unknowns]])

    def mode_lines(self) -> tuple[Array, NDArray[np.int64]]:
        """Lines of the bodies' outlines and of the flexures' axes, and their places in `line_motions`."""
        lines, places = self.plate.outline_lines()
        ends = self.frame.ends
        own = self.plate.unknowns + 3 * ends[:, :, None] + np.arange(2)
        return np.concatenate([lines, self.frame.nodes_mm[ends]]), np.concatenate([places, own])


KIND = "lumped"
TRUST, WHY_TRUSTED = 2, "both models replace the hinges by beams, and the lumped model has elastic bodies between them"

_ERRORS = ModelErrors(0.002, 0.015, 0.02, 0.015)
"""Relative model errors, from finite elements of other grippers: slope within 0.03 %, force 0.9 %, first modes 0.4 %
(`tests/benchmarks/models_held_out.py`), grip on a part 0.5 % (`models_grip.py`)."""


class LumpedGripper(DrawnGripper):
    """Lumped model of a gripper: hinge segments between the bodies of two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included.
    theory : HingeTheory
        Theory of the hinges' compliance.
    """

    name = KIND

    def __init__(
        self,
        gripper: Gripper,
        physics: Physics = LINEAR,
        theory: HingeTheory = HingeTheory.CORRECTED,
    ) -> None:
        errors = replace(_ERRORS, force=_ERRORS.force + 2.0 * force_uncertainty(gripper.material))
        if theory is HingeTheory.BEAM:
            errors = ERRORS_OF_BARS
        super().__init__(gripper, physics, MechanismFrame(half_mechanism(gripper), theory=theory), errors)


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> LumpedGripper:
    """Build the model; see `fingervision.models.kinds`."""
    return LumpedGripper(gripper, physics, theory)

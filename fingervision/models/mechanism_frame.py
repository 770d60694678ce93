"""A planar mechanism of lumped flexures between elastic bodies: any topology, loops included.

The model is the lumped model of Hricko & Havlik (2015), extended to any drawing. Flexures are chains of beam segments,
corrected by the hinge tables; the bodies that they join are cut from the drawing and condensed to a few coordinate
frames (`condensed_bodies`). Flexures and bodies may rotate by any angle.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, identity

from fingervision.domain.errors import ModelError
from fingervision.models.body_assembly import assemble_bodies
from fingervision.models.contact_pairs import contact_pair
from fingervision.models.corotational_body import turned_axes
from fingervision.models.corotational_frame import CorotationalFrame
from fingervision.models.flexure_span import FlexureSpan, span_of
from fingervision.models.flexure_stress import nominal_stress_mpa
from fingervision.models.frame_vibration import FrameVibration, SegmentMass, frame_vibration
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.mechanism import Contact, Mechanism, check_mechanism
from fingervision.models.mechanism_bodies import LinkBody, bodies_of, plate_poses
from fingervision.models.mechanism_equilibrium import DrivenMechanism, Gaps, MechanismEquilibrium
from fingervision.models.mechanism_faces import per_input_of
from fingervision.models.mechanism_state import MechanismState, changes, observables, state_in_equilibrium
from fingervision.models.modal_model import FreeModes, ModalModel
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.strip_energy import used_in_frame
from fingervision.models.triangulate import triangulate

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
_FORCE_MISUSED, _STRESS_ERROR, _STRESS_MISUSED = 0.05, 0.02, 0.3
"""Relative errors of force and stress where a guided drive shears or stretches flexures instead of bending them. Forces
across a notch are within 1 % of those in plane stress; forces along a notch are up to 4 % too low or too high (elliptic
cuts, wide plates). The stress is too low by 0.3 sqrt(t / R), because its peak is no longer at the neck."""
_TINIEST = 1e-300


class MechanismFrame:
    """Lumped model of a mechanism: flexures as beams between condensed elastic bodies.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    width_effect : bool
        Whether the restraint of the flexures by the plate's width is included; plane stress if False.
    theory : HingeTheory
        Theory of the notches' compliance.

    Raises
    ------
    FingervisionError
        If the drawing is not a valid mechanism, has no flexure, or a flexure does not join two bodies.
    """

    kind = "lumped"

    def __init__(
        self, mechanism: Mechanism, *, width_effect: bool = True, theory: HingeTheory = HingeTheory.CORRECTED
    ) -> None:
        self.mechanism, self.theory, self._width_effect = mechanism, theory, width_effect
        region = mechanism.region
        check_mechanism(mechanism, region)
        if not mechanism.flexures:
            raise ModelError(
                f"{mechanism.name} must have flexures to be a lumped model, but has none; take --kind finite_element."
            )
        self.spans = tuple(span_of(flexure, region) for flexure in mechanism.flexures)
        cut = PlanarRegion((*region.steps, *((False, span.slab) for span in self.spans)), region.marks_mm)
        mesh = triangulate(cut, _ACROSS, _BODY * region.size_mm)
        self._mesh, self._size_mm = mesh, region.size_mm
        self._assemble()
        if width_effect and any(not flexure.is_notch for flexure in mechanism.flexures):
            # The restraint of a strip by its width depends on how the strip is loaded, which is known only now.
            loads = self._end_loads(self.driven.unit_displacement, large=False)
            whole = 0.5 * self.stiffness_n_mm
            self.spans = tuple(
                span
                if span.flexure.is_notch
                else replace(span, flexure=used_in_frame(span, loads[list(own)], self.plate, whole))
                for span, own in zip(self.spans, self.segments, strict=True)
            )
            self.mechanism = replace(mechanism, flexures=tuple(span.flexure for span in self.spans))
            del self.driven
            self._assemble()

    def _assemble(self) -> None:
        mechanism = self.mechanism
        zones = tuple(f.zone(mechanism.plate_mm) for f in mechanism.flexures if not f.is_notch)
        used = zones if self._width_effect else ()
        self.plate = PlaneStressPlate(self._mesh, mechanism.material, mechanism.plate_mm, used)
        self.assembly = assemble_bodies(self.plate, mechanism, self.spans, self._size_mm)
        self._make_flexures()

    def _make_flexures(self) -> None:
        mechanism, assembly = self.mechanism, self.assembly
        places = [frame.at_mm for frame in assembly.frames]
        ends: list[tuple[int, int]] = []
        compliances: list[Array] = []
        self.segments: list[range] = []
        self._masses: list[SegmentMass] = []
        self._vibrating: tuple[int, FrameVibration] | None = None
        for span, (first, last) in zip(self.spans, assembly.ends, strict=True):
            stations = span.stations_mm(mechanism.plate_mm)
            nodes = [first, *range(len(places), len(places) + len(stations) - 2), last]
            places += [np.array(span.flexure.point_mm(x, 0.0)) for x in stations[1:-1].tolist()]
            self.segments.append(range(len(ends), len(ends) + len(stations) - 1))
            own = list(pairwise(nodes))
            ends += own
            compliances += list(span.compliances(mechanism.plate_mm, mechanism.material, self.theory,
                                                 width_effect=self._width_effect))  # fmt: skip
            weight = mechanism.material.density_t_mm3 * mechanism.plate_mm
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
        return DrivenMechanism(
            self.mechanism.name, self._tangent, lambda moved: self._tangent(moved)[1], csr_matrix(every[:, self.free]),
            self.by_drive, per_input_of(self.mechanism), tuple(map(self._gaps_of, self.mechanism.contacts)),
        )  # fmt: skip

    def _gaps_of(self, contact: Contact) -> Callable[[Array], Gaps]:
        """Return a function that gives the gaps of a contact at the two nodes of its face that are farthest apart."""
        plate = self.plate
        pair = contact_pair(plate, contact, self.mechanism, self._size_mm)
        places = plate.nodes_mm[:, pair.nodes]
        apart = places - places[:, :1]
        first = int(np.argmax(np.hypot(*apart)))
        second = int(np.argmax(np.hypot(*(places - places[:, [first]]))))
        ends = replace(pair, nodes=pair.nodes[[first, second]])

        def gaps(moved: Array) -> Gaps:
            field, slope = self.assembly.field(moved)
            gap, by_node, bend = ends.gaps_mm(plate, field)
            # The second derivative leaves out the rotation of the frames, which makes Newton's method a little slower.
            return gap, csr_matrix(by_node @ slope), lambda forces: csr_matrix(slope.T @ bend(forces) @ slope)

        return gaps

    @property
    def stiffness_n_mm(self) -> float:
        """Force at the drive per 1 mm of input, at rest (N/mm)."""
        return self.driven.input_stiffness_n_mm

    def touch_input_mm(self) -> dict[str, float]:
        """Input nearest to zero at which each contact first touches, in small displacements.

        Contacts that never touch are left out.
        """
        names = [contact.name for contact in self.mechanism.contacts]
        return {n: at for n, at in zip(names, self.driven.touch_inputs_mm(), strict=True) if at is not None}

    @cached_property
    def _errors(self) -> tuple[float, float]:
        """Relative errors of force and stress: as for flexures in bending, and larger for other loads on flexures."""
        loads, plate_mm = self._end_loads(self.driven.unit_displacement, large=False), self.mechanism.plate_mm
        misused, every, stress = 0.0, 0.0, 0.0
        for span, own in zip(self.spans, self.segments, strict=True):
            part, whole = misused_energy(span, loads[list(own)], self.frame.end_compliance[list(own)], plate_mm)
            misused, every = misused + part, every + whole
            if span.flexure.is_notch:
                ratio = min(span.notch(plate_mm).curvature_ratio, 1.0)
                stress = max(stress, _STRESS_MISUSED * sqrt(ratio) * part / max(whole, _TINIEST))
        force = _FORCE_ERROR + self.mechanism.width_error
        return force + _FORCE_MISUSED * misused / max(every, _TINIEST), _STRESS_ERROR + stress

    @property
    def force_error(self) -> float:
        """Relative error of the force, from the hinge tables, the width effect, and energy outside bending."""
        return self._errors[0]

    @property
    def stress_error(self) -> float:
        """Relative error of the stress in the flexures."""
        return self._errors[1]

    def _end_loads(self, moved: Array, *, large: bool) -> Array:
        """Tension and end moments of all segments of the flexures.

        For small displacements the segments' axes do not rotate: the loads are computed for a tiny fraction of the
        displacements and scaled up.
        """
        share = 1.0 if large else _TINY * self._size_mm / max(float(np.abs(moved).max()), _TINY)
        return np.asarray(self.frame.end_loads(share * moved) / share)

    def state(self, input_mm: float, *, large_rotation: bool = False, contact: bool = False) -> MechanismState:
        """Find the equilibrium at one input."""
        found = self.driven.equilibrium(input_mm, large_rotation=large_rotation, contact=contact)
        return self._seen(input_mm, found, large_rotation=large_rotation)

    def drive_states(self) -> tuple[MechanismState, ...]:
        """Small displacements per 1 mm of one driven face after another, with all other driven faces at rest."""
        return tuple(self._seen(1.0, found, large_rotation=False) for found in self.driven.by_one_drive())

    def _seen(self, input_mm: float, found: MechanismEquilibrium, *, large_rotation: bool) -> MechanismState:
        mechanism, moved = self.mechanism, found.displacement
        probes = {name: self._motion(moved, point, large=large_rotation) for name, point in mechanism.probes.items()}
        loads = self._end_loads(moved, large=large_rotation)
        stress = max(nominal_stress_mpa(span, loads[list(own)], mechanism, self.theory,
                                        width_effect=self._width_effect)
                     for span, own in zip(self.spans, self.segments, strict=True))  # fmt: skip
        poses = plate_poses(self.plate, self.bodies, self._field(moved, large=large_rotation), large=large_rotation)
        return state_in_equilibrium(mechanism, input_mm, found, probes, stress, poses, large=large_rotation)

    @cached_property
    def bodies(self) -> tuple[LinkBody, ...]:
        """The bodies that the flexures join."""
        return bodies_of(self.mechanism, self.spans)

    def _field(self, moved: Array, *, large: bool) -> Array:
        """Displacement of every node of the bodies."""
        if large:
            return self.assembly.field(moved)[0]
        return np.asarray(sum((body.shapes_mm @ moved[body.unknowns] for body in self.assembly.bodies),
                              np.zeros(self.plate.unknowns)))  # fmt: skip

    def _motion(self, moved: Array, point: tuple[float, float], *, large: bool) -> tuple[float, float]:
        """Displacement of a point of a body; a point on a flexure moves with the nearest section of it."""
        node = self._section_at(point)
        if node is None:
            return self.assembly.motion_mm(moved, point, large=large)
        x, y, angle = moved[3 * node : 3 * node + 3]
        arm = np.array(point) - self.frame.nodes_mm[node]
        turn = turned_axes(angle) - np.eye(2) if large else angle * np.array([[0.0, -1.0], [1.0, 0.0]])
        way = np.array([x, y]) + turn @ arm
        return float(way[0]), float(way[1])

    def _section_at(self, point: tuple[float, float]) -> int | None:
        """Node of the section of a flexure that is nearest to a point on the flexure; None for a point on a body."""
        for span, own in zip(self.spans, self.segments, strict=True):
            if span.slab.holds(np.array(point)[:, None])[0]:
                nodes = np.unique(self.frame.ends[list(own)])
                return int(nodes[np.argmin(np.hypot(*(self.frame.nodes_mm[nodes] - point).T))])
        return None

    def _vibration(self, count: int) -> FrameVibration:
        """Mass and stiffness with `count` own modes of every body; the result for the latest count is cached."""
        if self._vibrating is None or self._vibrating[0] != count:
            stiffness = self.driven.stiffness_n_mm.toarray()
            found = frame_vibration(self.assembly, stiffness, self._masses, self.free, self.by_input, count)
            self._vibrating = count, found
        return self._vibrating[1]

    def modes_hz(self, *, drive_held: bool, count: int = 3) -> tuple[float, ...]:
        """First natural frequencies in the plane, with the drive fixed or free to move along its direction (Hz)."""
        rad_s, _, _ = self._vibration(count).modes(drive_held=drive_held, count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array]:
        """First natural modes in the plane: angular frequencies in rad/s, and mode shapes of unit mass by column.

        A mode shape contains the displacements of the bodies' nodes, followed by the motions of the coordinate frames.
        """
        vibration = self._vibration(count)
        rad_s, shapes, _ = vibration.modes(drive_held=drive_held, count=count)
        return rad_s, np.vstack([vibration.field(shapes), shapes[: vibration.frames]])

    def mode_lines(self) -> tuple[Array, NDArray[np.int64]]:
        """Lines of the bodies' outlines and of the flexures' axes; see `mode_shapes.MovingMechanism`."""
        lines, places = self.plate.outline_lines()
        ends = self.frame.ends
        own = self.plate.unknowns + 3 * ends[:, :, None] + np.arange(2)
        return np.concatenate([lines, self.frame.nodes_mm[ends]]), np.concatenate([places, own])

    def modal_model(self, count: int) -> ModalModel:
        """Reduce the mechanism to its static shape and its modes with the drive fixed; see `MechanismPlate`."""
        vibration = self._vibration(count)
        rad_s, shapes, _ = vibration.modes(drive_held=True, count=count)
        static = np.append(self.driven.unit_displacement, np.zeros(shapes.shape[0] - vibration.frames))
        inertia = vibration.mass_t @ static
        return ModalModel(
            stiffness_n_mm=self.stiffness_n_mm,
            mass_t=float(static @ inertia),
            rad_s=rad_s,
            participation=shapes.T @ inertia,
            observed=observables(self.mechanism, self._probes_by(vibration, np.column_stack([static, shapes]))),
        )

    def free_modes(self, count: int) -> FreeModes:
        """Return the modes with the drive free along its direction."""
        vibration = self._vibration(count)
        rad_s, shapes, drive = vibration.modes(drive_held=False, count=count)
        return FreeModes(rad_s, drive, changes(self.mechanism, self._probes_by(vibration, shapes)))

    def _probes_by(self, vibration: FrameVibration, shapes: Array) -> dict[str, Array]:
        """Small motion of every probe caused by each column of displacements, shape (2, k)."""
        fields, found = vibration.field(shapes), {}
        for name, point in self.mechanism.probes.items():
            if self._section_at(point) is None:
                found[name] = self.plate.rows_at(point) @ fields
            else:
                by_column = (self._motion(column, point, large=False) for column in shapes[: vibration.frames].T)
                found[name] = np.array(list(by_column)).T
        return found

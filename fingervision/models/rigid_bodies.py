"""Stiffness-matrix model of a drawing by bodies: rigid bodies, joined by the stiffnesses of their flexures.

The model applies equations (5) to (15) of Hricko & Havlik (2015), in the plane: the compliance of flexure i at its end
is C_i = sum T C T', where T transforms the compliance C of each of its segments to that end. Its inverse joins the
motions of the two bodies, so that chains, trees and closed loops of bodies are one system of three equations a body,
with the motions that fixed faces, guides and drives prescribe.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.sparse import csr_matrix

from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import PointMm
from fingervision.models.corotational_frame import carried, frame_axes
from fingervision.models.elastic_mechanism import ElasticMechanism, LargestStress, MechanismState
from fingervision.models.flexure_span import FlexureSpan, span_of
from fingervision.models.flexure_stress import nominal_stress
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Face, Mechanism, check_mechanism
from fingervision.models.mechanism_bodies import MRAD, BodyPose
from fingervision.models.mechanism_equilibrium import DrivenMechanism
from fingervision.models.mechanism_faces import driven_components, per_input_of, with_actuators

Array = NDArray[np.float64]

_ON = 1e-6
_BESIDE = 0.05
_LOOSE = 1e-12
"""Smallest stiffness of a motion, as a share of the largest, below which the motion is free."""


class RigidBodies(ElasticMechanism):
    """Rigid bodies joined by flexures.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    theory : HingeTheory
        Theory of the notches' compliance.

    Raises
    ------
    FingervisionError
        If the drawing is not a valid mechanism, can move freely, or has several driven faces on one body.
    """

    kind = "stiffness_matrix"

    def __init__(self, mechanism: Mechanism, *, theory: HingeTheory = HingeTheory.CORRECTED) -> None:
        super().__init__(mechanism)
        self.theory, region = theory, mechanism.region
        check_mechanism(mechanism, region)
        if not mechanism.flexures:
            raise ModelError(
                f"{mechanism.name} must have flexures for a stiffness matrix, but has none; take --kind finite_element."
            )
        self._size_mm, self._near_mm = region.size_mm, _ON * region.size_mm
        by_layer = mechanism.by_layer
        spans = [span_of(flexure, by_layer[flexure.layer]) for flexure in mechanism.flexures]
        self._joins = [self._joined(span) for span in spans]
        # Bodies are rigid, so that a leaf bends over its whole free length.
        self.spans = [span if span.flexure.is_notch else replace(span, cut_mm=span.free_mm) for span in spans]
        if pressed := [drive.face.name for drive in mechanism.drives if drive.preload_n]:
            raise ModelError(
                f"The stiffness matrix does not change with the preload of {pressed[0]} of {mechanism.name}; take "
                "--kind lumped or finite_element."
            )
        driven = [self._only(drive.face) for drive in mechanism.drives]
        if len(set(driven)) < len(driven):
            raise ModelError(
                f"The stiffness-matrix model allows one driven face per body, but {mechanism.name} drives one body "
                "at several faces; take --kind lumped or finite_element."
            )

    def _body_of(self, point: Array, what: str, layer: int | None = None) -> int:
        for number, body in enumerate(self.bodies):
            inside = body.outline.holds(point[:, None]) if layer is None else body.holds(point[:, None], layer)
            if inside[0]:
                return number
        raise ModelError(f"{what} of {self.mechanism.name} must lie on a body, but does not.")

    def _joined(self, span: FlexureSpan) -> tuple[int, int]:
        flexure, apart = span.flexure, _BESIDE * span.flexure.thickness_mm
        ends = (span.cut_mm[0] - apart, span.cut_mm[1] + apart)
        layer = flexure.layer if self.mechanism.layers else None
        first, last = (self._body_of(np.array(flexure.section_mm(x)), f"flexure {flexure.name}", layer) for x in ends)
        return first, last

    def _touching(self, face: Face) -> set[int]:
        if face.is_pin:
            return {self._body_of(np.array(face.middle_mm), f"pin {face.name}")}
        return {
            number
            for number, body in enumerate(self.bodies)
            if any(face.holds(side, self._near_mm).any() for side in body.outline.sides_mm)
        }

    def _middle_mm(self, face: Face) -> Array:
        """Middle of the part of the outline in a face's box, at which its force acts."""
        if face.is_pin:
            return np.array(face.middle_mm)
        moment, length = np.zeros(2), 0.0
        for points in (side for body in self.bodies for side in body.outline.sides_mm):
            inside = face.holds(points, self._near_mm)
            steps = np.hypot(*np.diff(points, axis=1)) * (inside[1:] & inside[:-1])
            moment += 0.5 * (points[:, 1:] + points[:, :-1]) @ steps
            length += float(steps.sum())
        return moment / length if length > 0.0 else np.array(face.middle_mm)

    def _only(self, face: Face) -> int:
        bodies = self._touching(face)
        if len(bodies) != 1:
            raise ModelError(
                f"face {face.name} of {self.mechanism.name} must lie on one body, but lies on {len(bodies)}."
            )
        return bodies.pop()

    def _rows(self, body: int, at: Array) -> Array:
        """Motion (x, y, rotation) of a point of a body by the motions of all bodies at the origin."""
        rows = np.zeros((3, 3 * len(self.bodies)))
        rows[:, 3 * body : 3 * body + 3] = carried(at)
        return rows

    def _held_by(self, face: Face, components: tuple[str, ...]) -> list[int]:
        """Motions (0 x, 1 y, 2 rotation) of a body that a face fixes; rotation only if the face is wide enough."""
        x0, x1, y0, y1 = face.box_mm
        wide = {"x": y1 - y0, "y": x1 - x0}
        turns = [2] if any(wide[component] > self._near_mm for component in components) else []
        return ["xy".index(component) for component in components] + turns

    @cached_property
    def driven(self) -> DrivenMechanism:
        """The mechanism as a system whose equilibria can be computed.

        Raises
        ------
        ModelError
            If the mechanism can move freely.
        """
        mechanism, drives = self.mechanism, self.mechanism.drives
        stiffness = np.zeros((3 * len(self.bodies),) * 2)
        for apart, joint in self._joints:
            stiffness += apart.T @ joint @ apart
        held = [self._rows(body, np.zeros(2)) for face in mechanism.fixed for body in self._touching(face)]
        for face, component in mechanism.slides:
            held += [
                self._rows(body, self._middle_mm(face))[self._held_by(face, (component,))]
                for body in self._touching(face)
            ]
        values = [np.zeros((len(rows), len(drives))) for rows in held]
        faces = [self._rows(self._only(drive.face), self._middle_mm(drive.face)) for drive in drives]
        for place, (drive, rows) in enumerate(zip(drives, faces, strict=True)):
            kept = self._held_by(drive.face, driven_components(drive))
            kept = [motion for motion in kept if motion < 2 or drive.turns != "free"]
            held.append(rows[kept])
            values.append(np.outer((*drive.direction, 0.0), np.eye(len(drives))[place])[kept])
        conditions = np.vstack(held)
        free = null_space(conditions)
        left = np.linalg.eigvalsh(free.T @ stiffness @ free)
        if left.size and left[0] < _LOOSE * np.abs(stiffness).max():
            raise ModelError(f"{mechanism.name} must be held by its fixed faces, but can move freely.")
        by_drive = np.asarray(np.linalg.pinv(conditions) @ np.vstack(values), dtype=float)
        still = np.abs(conditions @ by_drive - np.vstack(values)).max(axis=0) > _LOOSE
        if stuck := [drive.face.name for drive, is_still in zip(drives, still, strict=True) if is_still]:
            raise ModelError(
                f"{stuck[0]} of {mechanism.name} must be able to move its body, but other faces of the body hold it; "
                "drive another body."
            )
        system = DrivenMechanism(
            mechanism.name, lambda moved: (csr_matrix(stiffness), stiffness @ moved), lambda moved: stiffness @ moved,
            csr_matrix(free), by_drive, per_input_of(mechanism), self._no_mass,
        )  # fmt: skip
        along = [np.array(drive.direction) @ rows[:2] for drive, rows in zip(drives, faces, strict=True)]
        return with_actuators(system, np.transpose(along), mechanism)

    @cached_property
    def _joints(self) -> list[tuple[Array, Array]]:
        """Of every flexure: motion of its second body relative to its first at its end, and its stiffness there."""
        mechanism, found = self.mechanism, []
        for span, (first, last) in zip(self.spans, self._joins, strict=True):
            stations = span.stations_mm(mechanism.plate_mm)
            parts = span.compliances(mechanism.plate_mm, mechanism.material, self.theory, width_effect=True)
            angle = np.radians(span.flexure.axis_deg)
            axes = frame_axes(np.cos(angle), np.sin(angle))
            end = np.array(span.flexure.section_mm(float(stations[-1])))
            total = np.zeros((3, 3))
            for x, part in zip(stations[1:].tolist(), parts, strict=True):
                moved = carried(end - np.array(span.flexure.section_mm(x))) @ axes
                total += moved @ part @ moved.T
            found.append(
                (
                    self._rows(last, end) - self._rows(first, end),
                    np.asarray(mechanism.halves * np.linalg.inv(total), dtype=float),
                )
            )
        return found

    @cached_property
    def _errors(self) -> tuple[float, float]:
        """Errors from treating bodies as rigid, by comparison with the lumped model."""
        elastic = MechanismFrame(self.mechanism, theory=self.theory)
        force = abs(self.stiffness_n_mm / elastic.stiffness_n_mm - 1.0)
        stress = abs(self.state(1.0).stress_mpa / elastic.state(1.0).stress_mpa - 1.0)
        return force + elastic.force_error, stress + elastic.stress_error

    def touch_input_mm(self) -> dict[str, float]:
        """Return no contact inputs, because this model does not include contact."""
        return {}

    @property
    def contact_points_mm(self) -> tuple[Array, ...]:
        """No points, because this model does not include contact."""
        return ()

    def modes_hz(self, *, drive_held: bool, count: int = 3) -> tuple[float, ...]:
        """Return no natural frequencies, because this model has no masses."""
        del drive_held, count
        return ()

    def _no_mass(self) -> csr_matrix:
        raise ModelError("The stiffness-matrix model has no masses; take --kind lumped or finite_element.")

    @property
    def swaying(self) -> "RigidBodies":
        """The half of a mirrored drawing whose other half moves the same way sideways."""
        return RigidBodies(self.mechanism.swaying, theory=self.theory)

    def state(self, input_mm: float, *, large_rotation: bool = False, contact: bool = False) -> MechanismState:
        """Compute the small displacements at one input.

        Raises
        ------
        ModelError
            If large rotation or contact is requested.
        """
        if large_rotation or contact:
            raise ModelError(
                "The stiffness matrix handles small displacements without contact only; take --kind lumped or "
                "finite_element."
            )
        return super().state(input_mm)

    def motion_mm(self, moved: Array, point: PointMm, *, large: bool) -> Array:
        """Displacement of a point of a body, or of a point just outside its outline."""
        del large
        at = np.array(point)
        return np.asarray(self._rows(self._body_of(at + self._inward(point), "a probe"), at)[:2] @ moved)

    def pulled(self, direction: PointMm, system: DrivenMechanism) -> Array:
        """Displacements of a rigid translation."""
        del system
        return np.tile([*direction, 0.0], len(self.bodies))

    def peak_stress(self, moved: Array, *, large: bool = False) -> LargestStress:
        """Largest nominal stress in the flexures, with the factors of a notch or of fillets."""
        del large
        found = []
        for span, (apart, joint) in zip(self.spans, self._joints, strict=True):
            pull, push, turn = joint @ apart @ moved / self.mechanism.halves
            stations = span.stations_mm(self.mechanism.plate_mm)
            angle = np.radians(span.flexure.axis_deg)
            x, y = (np.array(part) for part in span.flexure.section_mm(stations))
            moment = turn + (x[-1] - x) * push - (y[-1] - y) * pull
            tension = np.full(stations.size - 1, pull * np.cos(angle) + push * np.sin(angle))
            rows = np.column_stack([tension, -moment[:-1], moment[1:]])
            found.append(nominal_stress(span, rows, self.mechanism, self.theory))
        return max(found, key=lambda peak: peak.mpa)

    def drawn_poses(self, moved: Array, *, large: bool) -> Mapping[str, BodyPose]:
        """Motions of the rigid bodies."""
        del large
        poses = {}
        for number, body in enumerate(self.bodies):
            if not body.is_fixed:
                x, y, angle = self._rows(number, body.centroid_mm) @ moved
                poses[body.name] = BodyPose(float(x), float(y), MRAD * float(angle))
        return poses

    def mode_lines(self) -> tuple[Array, NDArray[np.int64]]:
        """Return nothing to draw, because this model has no modes."""
        return np.zeros((0, 2, 2)), np.zeros((0, 2, 2), dtype=np.int64)

    def _inward(self, point: PointMm) -> Array:
        """Return a point slightly inside the body, next to a point on its outline."""
        for angle in np.linspace(0.0, 2.0 * np.pi, 9)[:-1]:
            way = 1e-5 * self._size_mm * np.array([np.cos(angle), np.sin(angle)])
            beside = (np.array(point) + way)[:, None]
            if any(body.outline.holds(beside)[0] for body in self.bodies):
                return way
        return np.zeros(2)

"""Stiffness-matrix model of a chain of rigid bodies: the compliances of its flexures are summed at the drive.

The model applies equations (5) to (15) of Hricko & Havlik (2015), in the plane, to any chain from a fixed body to the
driven one: the compliance at the drive is C = sum T C_i T', where T transforms the compliance C_i of flexure i to the
drive. The stiffness is the inverse of the compliance in the directions that the drive and its guides constrain. Several
drives act as loads at several bodies of a tree of bodies. A drawing with a closed loop of bodies is refused, because
compliances can be summed only along chains and trees.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import ModelError
from fingervision.models.elastic_mechanism import MechanismState, named_by_drive, pair_distances_mm
from fingervision.models.flexure_span import FlexureSpan, span_of
from fingervision.models.flexure_stress import nominal_stress
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Face, Mechanism, check_mechanism
from fingervision.models.mechanism_bodies import MRAD, BodyPose, LinkBody, bodies_of
from fingervision.models.mechanism_faces import driven_components, per_input_of
from fingervision.models.planar_region import PlanarRegion

Array = NDArray[np.float64]

_SAMPLES = 65
_ON = 1e-6
_BESIDE = 0.05


class MechanismChain:
    """A chain of rigid bodies and flexures.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    theory : HingeTheory
        Theory of the notches' compliance.

    Raises
    ------
    FingervisionError
        If the drawing is not a valid mechanism, its flexures form a loop, or no chain of flexures leads to the driven
        body.
    """

    kind = "stiffness_matrix"

    def __init__(self, mechanism: Mechanism, *, theory: HingeTheory = HingeTheory.CORRECTED) -> None:
        self.mechanism, self.theory = mechanism, theory
        region = mechanism.region
        check_mechanism(mechanism, region)
        self._size_mm = region.size_mm
        spans = [span_of(flexure, region) for flexure in mechanism.flexures]
        cut = PlanarRegion((*region.steps, *((False, span.slab) for span in spans)), region.marks_mm)
        self._bodies = [loop for loop in cut.loops if loop.area_mm2 > 0.0]
        self.bodies: tuple[LinkBody, ...] = bodies_of(mechanism)
        # Bodies are rigid, so that a leaf bends over its whole free length.
        self.spans = [span if span.flexure.is_notch else replace(span, cut_mm=span.free_mm) for span in spans]
        self._joins = [self._joined(span) for span in spans]
        self._ground = {body for face in mechanism.fixed for body in self._touching(face)}
        bodies = [self._only(drive.face) for drive in mechanism.drives]
        if len(set(bodies)) < len(bodies):
            raise ModelError(
                f"The stiffness-matrix model allows one driven face per body, but {mechanism.name} drives one body "
                "at several faces; take --kind lumped or finite_element."
            )
        self._paths = [self._path_from(self._ground, body) for body in bodies]
        self._support(bodies)

    def _body_of(self, point: Array, what: str) -> int:
        for number, loop in enumerate(self._bodies):
            if loop.holds((float(point[0]), float(point[1]))):
                return number
        raise ModelError(f"{what} of {self.mechanism.name} must lie on a body, but does not.")

    def _joined(self, span: FlexureSpan) -> tuple[int, int]:
        flexure, apart = span.flexure, _BESIDE * span.flexure.thickness_mm
        ends = (span.cut_mm[0] - apart, span.cut_mm[1] + apart)
        first, last = (self._body_of(np.array(flexure.point_mm(x, 0.0)), f"flexure {flexure.name}") for x in ends)
        return first, last

    def _touching(self, face: Face) -> set[int]:
        if face.is_pin:
            return {self._body_of(np.array(face.middle_mm), f"pin {face.name}")}
        x0, x1, y0, y1 = face.box_mm
        near = _ON * self._size_mm
        found = set()
        for number, loop in enumerate(self._bodies):
            x, y = np.concatenate([c.at(np.linspace(c.t0, c.t1, _SAMPLES)) for c in loop.curves], axis=1)
            if np.any((x >= x0 - near) & (x <= x1 + near) & (y >= y0 - near) & (y <= y1 + near)):
                found.add(number)
        return found

    def _middle_mm(self, face: Face) -> Array:
        """Middle of the part of the outline in a face's box, at which its force acts."""
        if face.is_pin:
            return np.array(face.middle_mm)
        x0, x1, y0, y1 = face.box_mm
        near, moment, length = _ON * self._size_mm, np.zeros(2), 0.0
        for curve in (curve for loop in self._bodies for curve in loop.curves):
            points = curve.at(np.linspace(curve.t0, curve.t1, _SAMPLES))
            x, y = points
            inside = (x >= x0 - near) & (x <= x1 + near) & (y >= y0 - near) & (y <= y1 + near)
            steps = np.hypot(*np.diff(points, axis=1)) * (inside[1:] & inside[:-1])
            moment += 0.5 * (points[:, 1:] + points[:, :-1]) @ steps
            length += float(steps.sum())
        return moment / length if length > 0.0 else np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])

    def _only(self, face: Face) -> int:
        bodies = self._touching(face)
        if len(bodies) != 1:
            raise ModelError(
                f"face {face.name} of {self.mechanism.name} must lie on one body, but lies on {len(bodies)}."
            )
        return bodies.pop()

    def _path_from(self, ground: set[int], driven: int) -> list[int]:
        """List the flexures on the path from the fixed body (ground) to the driven body, in order.

        In a chain, the number of flexures is one less than the number of bodies, including the fixed one.
        """
        name = self.mechanism.name
        merged = [tuple(-1 if body in ground else body for body in join) for join in self._joins]
        bodies = {body for join in merged for body in join}
        if len(merged) != len(bodies) - 1 or any(first == last for first, last in merged):
            raise ModelError(
                f"The stiffness-matrix model needs bodies in a chain, but the flexures of {name} form a loop; take "
                "--kind lumped or finite_element."
            )
        reached: dict[int, list[int]] = {-1: []}
        while driven not in reached:
            grown = False
            for place, (first, last) in enumerate(merged):
                for known, other in ((first, last), (last, first)):
                    if known in reached and other not in reached:
                        reached[other], grown = [*reached[known], place], True
            if not grown:
                raise ModelError(
                    f"The stiffness-matrix model needs bodies in a chain from a fixed face to the drive, but {name} "
                    "has none; take --kind lumped or finite_element."
                )
        self._reached = reached
        return reached[driven]

    def _support(self, bodies: list[int]) -> None:
        """Find the motions (x, y, rotation) fixed by drives and guides, and reaction loads per 1 mm of each drive."""
        mechanism = self.mechanism
        drives = mechanism.drives
        held = [
            self._held_by(drive.face, driven_components(drive)) - ({2} if drive.turns == "free" else set())
            for drive in drives
        ]
        for face, component in mechanism.slides:
            touching = self._touching(face)
            if len(touching) != 1 or not touching <= set(bodies):
                raise ModelError(
                    f"The stiffness-matrix model needs bodies in a chain that is fixed at one end, but "
                    f"{mechanism.name} is held at {face.name} too; take --kind lumped or finite_element."
                )
            held[bodies.index(touching.pop())] |= self._held_by(face, (component,))
        self._at = np.array([self._middle_mm(drive.face) for drive in drives])
        kept = [3 * place + i for place, own in enumerate(held) for i in sorted(own)]
        motions = np.zeros((3 * len(drives), len(drives)))
        for place, drive in enumerate(drives):
            motions[3 * place : 3 * place + 2, place] = drive.direction
        ends = list(zip(self._at, self._paths, strict=True))
        compliance = np.block([
            [self.compliance_at(to, [p for p in own if p in theirs], at) for at, theirs in ends] for to, own in ends
        ])  # fmt: skip
        self._by_drive = np.zeros((3 * len(drives), len(drives)))
        self._by_drive[kept] = np.linalg.solve(compliance[np.ix_(kept, kept)], motions[kept])
        # The face of a soft actuator moves by less than its input: push - spring * motion is the mechanism's force.
        soft = np.array([drive.is_soft for drive in drives])
        spring = np.diag([drive.spring_n_mm if drive.is_soft else 1.0 for drive in drives])
        push = np.diag([drive.push_n if drive.is_soft else 1.0 for drive in drives])
        yielding = np.where(soft[:, None], motions.T @ self._by_drive, 0.0)
        self._faces = np.linalg.solve(yielding + spring, push)
        self._by_drive = self._by_drive @ self._faces
        self._motions = motions
        self._load = self._by_drive @ per_input_of(mechanism)

    def _held_by(self, face: Face, components: tuple[str, ...]) -> set[int]:
        """Motions (0 x, 1 y, 2 rotation) of a body that a face fixes; rotation only if the face is wide enough."""
        x0, x1, y0, y1 = face.box_mm
        wide = {"x": y1 - y0, "y": x1 - x0}
        turns = {2} if any(wide[component] > _ON * self._size_mm for component in components) else set()
        return {"xy".index(component) for component in components} | turns

    def compliance_at(self, point: Array, path: list[int], loaded: Array | None = None) -> Array:
        """Motion (x, y, rotation) of one point under a load at another point of the chain, shape (3, 3).

        Parameters
        ----------
        point : ndarray of float, shape (2,)
            The point that moves.
        path : list of int
            Flexures between the ground and that point which also carry the load.
        loaded : ndarray of float, shape (2,), or None
            The point at which the load acts; None for the moving point itself.
        """
        mechanism = self.mechanism
        total = np.zeros((3, 3))
        for place in path:
            span = self.spans[place]
            stations = span.stations_mm(mechanism.plate_mm)
            parts = span.compliances(mechanism.plate_mm, mechanism.material, self.theory, width_effect=True)
            angle = np.radians(span.flexure.axis_deg)
            axes = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0, 0, 1.0]])
            for x, part in zip(stations[1:].tolist(), parts, strict=True):
                at = np.array(span.flexure.point_mm(x, 0.0))
                moved, pressed = _carried(point - at), _carried((point if loaded is None else loaded) - at)
                total += moved @ axes @ part @ axes.T @ pressed.T
        return total

    @property
    def stiffness_n_mm(self) -> float:
        """Force at the drive per 1 mm of input (N/mm)."""
        return float(per_input_of(self.mechanism) @ self._motions.T @ self._load)

    @property
    def force_error(self) -> float:
        """Relative error of the force from treating bodies as rigid, by comparison with the lumped model."""
        return self._errors[0]

    @property
    def stress_error(self) -> float:
        """Relative error of the stress from treating bodies as rigid, by comparison with the lumped model."""
        return self._errors[1]

    @cached_property
    def _errors(self) -> tuple[float, float]:
        elastic = MechanismFrame(self.mechanism, theory=self.theory)
        force = abs(self.stiffness_n_mm / elastic.stiffness_n_mm - 1.0)
        stress = abs(self.state(1.0).stress_mpa / elastic.state(1.0).stress_mpa - 1.0)
        return force + elastic.force_error, stress + elastic.stress_error

    def touch_input_mm(self) -> dict[str, float]:
        """Return no contact inputs, because this model does not include contact."""
        return {}

    def modes_hz(self, *, drive_held: bool, count: int = 3) -> tuple[float, ...]:
        """Return no natural frequencies, because this model has no masses."""
        del drive_held, count
        return ()

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
        return self._seen(input_mm, input_mm * self._load, per_input_of(self.mechanism))

    def drive_states(self) -> tuple[MechanismState, ...]:
        """Small displacements per 1 mm of one driven face after another, with all other driven faces at rest."""
        alone = np.eye(len(self.mechanism.drives))
        return tuple(self._seen(1.0, load, own) for load, own in zip(self._by_drive.T, alone, strict=True))

    def _seen(self, input_mm: float, load: Array, per_input: Array) -> MechanismState:
        mechanism = self.mechanism
        probes = {}
        for name, point in mechanism.probes.items():
            own = self._reached_by(self._body_of(np.array(point) + self._inward(point), f"probe {name}"))
            moved = self._moved(np.array(point), own, load)
            probes[name] = (float(moved[0]), float(moved[1]))
        stress = max(self._stress_mpa(place, load) for place in {place for path in self._paths for place in path})
        pairs = pair_distances_mm(mechanism, probes, large=False)
        forces = self._motions.T @ load
        return MechanismState(
            input_mm,
            float(per_input @ forces),
            probes,
            pairs,
            stress,
            load,
            {},
            self._poses(load),
            named_by_drive(mechanism, forces),
            faces_mm=named_by_drive(mechanism, self._faces @ (per_input * input_mm)),
        )

    def _moved(self, point: Array, own: list[int], load: Array) -> Array:
        """Motion (x, y, rotation) of a point beyond the flexures `own`, under the loads at all drives."""
        return np.asarray(sum(
            self.compliance_at(point, [place for place in path if place in own], at) @ part
            for at, path, part in zip(self._at, self._paths, load.reshape(-1, 3), strict=True)
        ))  # fmt: skip

    def _poses(self, load: Array) -> dict[str, BodyPose]:
        """Motions of the rigid bodies under loads at the drives."""
        found = {}
        for number, body in enumerate(self.bodies):
            if not body.is_fixed:
                x, y, angle = self._moved(body.centroid_mm, self._reached_by(number), load)
                found[body.name] = BodyPose(float(x), float(y), MRAD * float(angle))
        return found

    def _reached_by(self, body: int) -> list[int]:
        if body in self._ground:
            return []
        while body not in self._reached:
            before = len(self._reached)
            for place, join in enumerate(self._joins):
                known = [-1 if b in self._ground else b for b in join]
                for one, other in (known, known[::-1]):
                    if one in self._reached and other not in self._reached:
                        self._reached[other] = [*self._reached[one], place]
            if len(self._reached) == before:
                raise ModelError(f"A probe of {self.mechanism.name} lies on a body that is not joined to a fixed face.")
        return self._reached[body]

    def _inward(self, point: tuple[float, float]) -> Array:
        """Return a point slightly inside the body, next to a point on its outline."""
        for angle in np.linspace(0.0, 2.0 * np.pi, 9)[:-1]:
            way = 1e-5 * self._size_mm * np.array([np.cos(angle), np.sin(angle)])
            x, y = np.array(point) + way
            if any(loop.holds((float(x), float(y))) for loop in self._bodies):
                return way
        return np.zeros(2)

    def _stress_mpa(self, place: int, load: Array) -> float:
        """Largest stress in one flexure (MPa), under the loads of those drives that the flexure carries."""
        span = self.spans[place]
        stations = span.stations_mm(self.mechanism.plate_mm)
        angle = np.radians(span.flexure.axis_deg)
        x, y = (np.array(part) for part in span.flexure.point_mm(stations, 0.0))
        tension, moment = 0.0, np.zeros(stations.size)
        for at, path, (pull, push, turn) in zip(self._at, self._paths, load.reshape(-1, 3), strict=True):
            if place in path:
                tension += float(pull * np.cos(angle) + push * np.sin(angle))
                moment = moment + turn + (at[0] - x) * push - (at[1] - y) * pull
        rows = np.column_stack([np.full(stations.size - 1, tension), -moment[:-1], moment[1:]])
        return nominal_stress(span, rows, self.mechanism, self.theory).mpa


def _carried(arm: Array) -> Array:
    """Matrix that gives the motion at the end of an arm from that at its start; its transpose transfers loads back."""
    return np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]])

"""Response of a mechanism with a local change: stiffness or position of a hinge, or slip in a pivot.

Bodies keep their condensed stiffness; a displaced flexure is connected to them by a rigid arm, and a flexure of changed
thickness keeps its ends. The response to each local change requires the solution of one small system of equations,
which takes a thousandth of the time of a new mesh.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq

from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import PointMm
from fingervision.models.corotational_frame import CorotationalFrame
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import MRAD, LinkBody, body_weights

Array = NDArray[np.float64]

PARTS = ("x_mm", "y_mm", "angle_mrad")
"""Components of a body's pose."""
_SIMPSON = (1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0)
"""Simpson weights of an edge's two ends and its middle: exact for quadratic functions along the edge, as displacements
are."""
_THINNEST, _THICKEST = 0.3, 2.5
"""Range of a flexure's thickness relative to the drawn one: its bending stiffness is then between 0.03 and 15 times the
drawn one."""


@dataclass(frozen=True, slots=True)
class PlaceChanges:
    """Changes of single hinges or links of a mechanism relative to its drawing.

    Parameters
    ----------
    stiffness : mapping of int to float
        Relative change of a flexure's bending stiffness, through its thickness; the key is the flexure's number.
    moved_mm : mapping of int to (float, float)
        Displacement of a flexure from its drawn position; the key is the flexure's number.
    probes_mm : mapping of str to (float, float)
        Displacement of a probe from its drawn position; the key is the probe's name.
    """

    stiffness: Mapping[int, float]
    moved_mm: Mapping[int, PointMm]
    probes_mm: Mapping[str, PointMm]


AS_DRAWN = PlaceChanges({}, {}, {})


@dataclass(frozen=True, slots=True, eq=False)
class LinearAnswer:
    """Small-displacement response of all outputs (channels) of a mechanism.

    Parameters
    ----------
    by_input : ndarray of float, shape (channels,)
        Change of every channel per 1 mm of input.
    by_slip : ndarray of float, shape (flexures, channels, 2)
        Change of every channel per 1 mm of slip along x and y in a flexure, between the two bodies that it joins, at
        its middle, with the drive held.
    load_by_input : ndarray of float, shape (flexures, 2)
        Force in the direction of each flexure's slip per 1 mm of input, in N: the force that its pivot carries.
    slip_stiffness : ndarray of float, shape (flexures, 2, 2)
        Force against a slip, in N/mm.
    """

    by_input: Array
    by_slip: Array
    load_by_input: Array
    slip_stiffness: Array


class PlaceAnswers:
    """A mechanism of lumped flexures whose hinges and links can be changed.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    model : MechanismFrame or None
        Lumped model of the mechanism, if already built.
    """

    def __init__(self, mechanism: Mechanism, model: MechanismFrame | None = None) -> None:
        self.mechanism = mechanism
        if any(drive.preload_n for drive in mechanism.drives):
            raise ModelError(
                f"Changed places of {mechanism.name} are computed without preload of its drives: leave out preload_n."
            )
        if mechanism.layers:
            raise ModelError(
                f"Changed places of {mechanism.name} are computed for a drawing of one layer, but it has more."
            )
        self.model = model or MechanismFrame(mechanism)
        self._make_observers()

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Names of the outputs: poses of bodies, angles of hinges, probes, pairs of probes, the force at the drive."""
        bodies = [f"{name}.{part}" for name in self._weights for part in PARTS]
        hinges = [f"{flexure.name}.angle_mrad" for flexure in self.mechanism.flexures]
        probes = [f"{name}_{axis}_mm" for name in self.mechanism.probes for axis in "xy"]
        return (*bodies, *hinges, *probes, *(f"{name}_mm" for name in self.mechanism.pairs), "force_n")

    def _make_observers(self) -> None:
        """Express the outputs as linear functionals of the frames' motions; hinge angles from body rotations."""
        assembly, plate = self.model.assembly, self.model.plate
        self._weights = body_weights(plate, self.model.bodies)
        self._probe_of: dict[str, tuple[int, Array]] = {}
        self._poses = np.zeros((3 * len(self._weights), self.model.frame.unknowns))
        for number in range(len(assembly.bodies)):
            here = assembly.piece == number
            for place, (weights, centroid) in enumerate(self._weights.values()):
                if weights[here].sum() > 0.5 * weights.sum():
                    own = self._pose_of(number, weights, centroid)
                    self._poses[3 * place : 3 * place + 3] = own * np.array([[1.0], [1.0], [MRAD]])
        for name, point in self.mechanism.probes.items():
            number = int(assembly.piece[np.argmin(np.hypot(*(plate.nodes_mm - np.array(point)[:, None])))])
            body, own = assembly.bodies[number], np.zeros((3, self.model.frame.unknowns))
            own[:2, body.unknowns] = plate.rows_at(point) @ body.shapes_mm
            # The rotation of the body moves a probe that is displaced from its drawn position.
            own[2] = self._turn_of(number)
            self._probe_of[name] = number, own

    def _pose_of(self, body: int, weights: Array, about_mm: Array) -> Array:
        """Mean motion of a body (x, y, rotation in rad) at a point, as functionals of the frames' motions."""
        assembly, plate = self.model.assembly, self.model.plate
        nodes, own = np.flatnonzero(assembly.piece == body), assembly.bodies[body]
        share = weights[nodes] / weights[nodes].sum()
        middle = plate.nodes_mm[:, nodes] @ share
        arm, reach = plate.nodes_mm[:, nodes] - middle[:, None], about_mm - middle
        x, y = own.shapes_mm[plate.x_dofs[nodes]], own.shapes_mm[plate.y_dofs[nodes]]
        angle = ((share * arm[0]) @ y - (share * arm[1]) @ x) / float(share @ np.sum(arm**2, axis=0))
        rows = np.zeros((3, self.model.frame.unknowns))
        rows[:, own.unknowns] = np.stack([share @ x - angle * reach[1], share @ y + angle * reach[0], angle])
        return rows

    def _turn_of(self, body: int) -> Array:
        """Mean rotation of a body (rad), as a functional of the coordinate frames' motions."""
        return np.asarray(self._pose_of(body, np.ones(self.model.plate.x_dofs.size), np.zeros(2))[2])

    @property
    def moving_bodies(self) -> tuple[str, ...]:
        """Names of the bodies whose pose is computed."""
        return tuple(self._weights)

    def numbered_bodies(self) -> dict[int, LinkBody]:
        """Bodies of the drawing by their number."""
        model, found = self.model, {}
        for number in range(len(model.assembly.bodies)):
            nodes = np.flatnonzero(model.assembly.piece == number)
            held = [float(body.holds(model.plate.nodes_mm[:, nodes[::7]]).mean()) for body in model.bodies]
            found[number] = model.bodies[int(np.argmax(held))]
        return found

    @cached_property
    def by_edges(self) -> Array:
        """Extra change of each channel per 1 mm of input if the poses are measured from edges, shape (channels,).

        If a body bends, the mean motion of its outline differs from that of its area. A picture shows only the edges of
        a body: the pose of the edges is the rigid motion nearest to their displacements along their normals.
        """
        model, plate = self.model, self.model.plate
        moved = model.driven.equilibrium(1.0, large_rotation=False, contact=False).displacement
        first, last, middle = plate.outline_edges
        own_of, angle_of = dict.fromkeys(self.channels, 0.0), {}
        for number, link in self.numbered_bodies().items():
            body, on = model.assembly.bodies[number], model.assembly.piece == number
            edges = on[first] & on[last] & on[middle]
            if link.name not in self._weights or not edges.any():
                continue
            way = plate.nodes_mm[:, last[edges]] - plate.nodes_mm[:, first[edges]]
            length = np.hypot(*way)
            normal = np.tile(np.stack([-way[1], way[0]]) / length, 3)
            root = np.sqrt(np.concatenate([share * length for share in _SIMPSON]))
            at = np.concatenate([first[edges], last[edges], middle[edges]])
            _, centroid = self._weights[link.name]
            arm = plate.nodes_mm[:, at] - centroid[:, None]
            columns = np.stack([normal[0], normal[1], arm[0] * normal[1] - arm[1] * normal[0]], axis=1)
            bent = body.shapes_mm @ moved[body.unknowns]
            along = normal[0] * bent[plate.x_dofs[at]] + normal[1] * bent[plate.y_dofs[at]]
            found = np.linalg.lstsq(columns * root[:, None], along * root, rcond=None)[0] * (1.0, 1.0, MRAD)
            place = 3 * list(self._weights).index(link.name)
            change = found - self._poses[place : place + 3] @ moved
            own_of |= {f"{link.name}.{part}": float(v) for part, v in zip(PARTS, change, strict=True)}
            angle_of[number] = float(change[2])
        for number, flexure in enumerate(self.mechanism.flexures):
            before, beyond = self.ends(number)
            own_of[f"{flexure.name}.angle_mrad"] = angle_of.get(beyond, 0.0) - angle_of.get(before, 0.0)
        return np.array([own_of[name] for name in self.channels])

    def body_of_frame(self, frame: int) -> int:
        """Number of the body to which a coordinate frame belongs."""
        return next(n for n, body in enumerate(self.model.assembly.bodies) if frame in body.frames)

    def ends(self, flexure: int) -> tuple[int, int]:
        """Numbers of the two bodies that a flexure joins."""
        first, last = self.model.assembly.ends[flexure]
        return self.body_of_frame(first), self.body_of_frame(last)

    def body_of_probe(self, probe: str) -> int:
        """Number of the body that a probe lies on."""
        return self._probe_of[probe][0]

    def thickness_for(self, flexure: int, ratio: float) -> float:
        """Thickness (mm) at which a flexure's bending stiffness is (1 + ratio) times that of the drawing."""
        drawn = self.mechanism.flexures[flexure].thickness_mm
        softness = self._bending_compliance(flexure, drawn) / (1.0 + ratio)
        return float(brentq(lambda t: np.log(self._bending_compliance(flexure, t) / softness),
                            _THINNEST * drawn, _THICKEST * drawn, xtol=1e-9 * drawn))  # fmt: skip

    def _bending_compliance(self, flexure: int, thickness_mm: float) -> float:
        return float(self._compliances(flexure, thickness_mm)[:, 2, 2].sum())

    def _compliances(self, flexure: int, thickness_mm: float) -> Array:
        mechanism, span = self.mechanism, self.model.spans[flexure]
        changed = replace(span, flexure=replace(span.flexure, thickness_mm=thickness_mm))
        own = changed.compliances(mechanism.plate_mm, mechanism.material, self.model.theory, width_effect=True)
        # The compliances are those of the changed thickness; the segments keep their ends and their number.
        return np.asarray(own)

    def answer(self, changes: PlaceChanges = AS_DRAWN) -> LinearAnswer:
        """Compute all outputs of the mechanism with the given changes of hinges or links."""
        model, frame = self.model, self.model.frame
        size = frame.unknowns
        compliance = frame.end_compliance.copy()
        for flexure, ratio in changes.stiffness.items():
            own = model.segments[flexure]
            compliance[list(own)] = self._compliances(flexure, self.thickness_for(flexure, ratio))
        changed = CorotationalFrame(frame.nodes_mm, frame.ends, compliance)
        stiffness = changed.stiffness_n_mm().toarray()
        arms = np.eye(size)
        for flexure, (x, y) in changes.moved_mm.items():
            for node in model.assembly.ends[flexure]:
                # The body's coordinate frame stays in place; the flexure is joined to the end of a rigid arm.
                arms[3 * node, 3 * node + 2], arms[3 * node + 1, 3 * node + 2] = y, -x
        for body in model.assembly.bodies:
            dofs = body.unknowns
            arm = arms[np.ix_(dofs, dofs)]
            stiffness[np.ix_(dofs, dofs)] += arm.T @ body.stiffness_n_mm @ arm
        if model.driven.actuators is not None:
            raise ModelError(
                f"A changed hinge or link of {self.mechanism.name} can be predicted where every drive is a stage, but "
                "one has a stiffness or a force of its own; leave out its stiffness_n_mm and force_n_per_input, and "
                "give the motion of the driven face as the input."
            )
        free, unit = model.free, model.by_input
        factor = cho_factor(stiffness[np.ix_(free, free)])
        loads, energies = self._slips(changed)
        sides = np.column_stack([-(stiffness @ unit), loads])[free]
        moved = np.zeros((size, sides.shape[1]))
        moved[free] = cho_solve(factor, sides)
        moved[:, 0] += unit
        observe = self._observer(arms, changes)
        seen = observe @ moved
        # Force at the drive: from the input, and from a slip with the drive held.
        seen[-1] = unit @ (stiffness @ moved - np.column_stack([np.zeros(size), loads]))
        count = len(self.mechanism.flexures)
        by_slip = seen[:, 1:].reshape(seen.shape[0], count, 2).transpose(1, 0, 2).copy()
        load_by_input = (loads.T @ moved[:, 0]).reshape(count, 2)
        back = loads.T @ moved[:, 1:]
        slip_stiffness = np.array([energies[n] - back[2 * n : 2 * n + 2, 2 * n : 2 * n + 2] for n in range(count)])
        return LinearAnswer(seen[:, 0], by_slip, load_by_input, slip_stiffness)

    def _slips(self, frame: CorotationalFrame) -> tuple[Array, Array]:
        """Loads of a unit slip at the middle of each flexure, shape (unknowns, 2 n), and stiffness against the slip."""
        loads, own = [], []
        for segments in self.model.segments:
            element = segments[len(segments) // 2 - 1]
            alone = CorotationalFrame(
                frame.nodes_mm, frame.ends[[element]], frame.end_compliance[[element]]
            ).stiffness_n_mm()
            node = int(frame.ends[element, 1])
            at = [3 * node, 3 * node + 1]
            # The displacement of the element's end is that of the node minus the slip, so that a unit slip loads the
            # node by the element's stiffness.
            block = alone[:, at].toarray()
            loads.append(block)
            own.append(block[at])
        return np.concatenate(loads, axis=1), np.array(own)

    def _observer(self, arms: Array, changes: PlaceChanges) -> Array:
        rows = [*(self._poses @ arms)]
        for number in range(len(self.mechanism.flexures)):
            first, last = self.ends(number)
            rows.append(MRAD * (self._turn_of(last) - self._turn_of(first)) @ arms)
        probes: dict[str, Array] = {}
        for name, (_, own) in self._probe_of.items():
            x, y = changes.probes_mm.get(name, (0.0, 0.0))
            probes[name] = np.stack([own[0] - y * own[2], own[1] + x * own[2]]) @ arms
            rows += [*probes[name]]
        for a, b in self.mechanism.pairs.values():
            apart = np.array(self.mechanism.probes[b]) - self.mechanism.probes[a]
            rows.append((apart / np.hypot(*apart)) @ (probes[b] - probes[a]))
        rows.append(np.zeros(arms.shape[0]))
        return np.array(rows)


def attachments(answers: PlaceAnswers) -> Sequence[Mapping[str, PointMm]]:
    """Points at which each body is supported or driven: middles of its flexures, then supports and drive."""
    model = answers.model
    found: list[dict[str, PointMm]] = [{} for _ in model.assembly.bodies]
    for number, flexure in enumerate(answers.mechanism.flexures):
        for body in answers.ends(number):
            found[body][flexure.name] = flexure.at_mm
    mechanism = answers.mechanism
    for face in (
        *mechanism.fixed,
        *(face for face, _ in mechanism.slides),
        *(drive.face for drive in mechanism.drives),
    ):
        x0, x1, y0, y1 = face.box_mm
        middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        nodes = model.plate.nodes_mm
        nearest = int(np.argmin(np.hypot(nodes[0] - middle[0], nodes[1] - middle[1])))
        found[int(model.assembly.piece[nearest])][face.name] = middle
    return found

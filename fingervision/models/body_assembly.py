"""Assembly of a mechanism: bodies cut from the drawing, meshed, condensed to coordinate frames, joined by flexures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_matrix, diags, hstack, identity, lil_matrix

from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import PointMm
from fingervision.models.condensed_bodies import (
    CondensedBody,
    Frame,
    OwnModes,
    condensed,
    face_frame,
    nodes_of,
    own_modes,
    section_frame,
)
from fingervision.models.corotational_frame import CorotationalBody, turned_axes
from fingervision.models.flexure_span import FlexureSpan
from fingervision.models.mechanism import Face, Mechanism
from fingervision.models.mechanism_equilibrium import DrivenMechanism, Gaps
from fingervision.models.mechanism_faces import (
    drive_weights,
    driven_components,
    moves_in_the_mean,
    nodes_on,
    pieces_of,
    supports_of,
)
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_NEAR = 1e-7
"""Largest distance of a node from a cut at which the node counts as lying on the cut, as a share of the body's size."""
_OVER = 1.1
"""Height within which nodes on a cut belong to its section, as a multiple of the section's height."""


@dataclass(frozen=True, slots=True, eq=False)
class BodyAssembly:
    """The meshed and condensed bodies, and which motions of their coordinate frames are fixed or driven.

    Parameters
    ----------
    plate : PlaneStressPlate
        All bodies, meshed.
    piece : ndarray of int
        Number of the body to which each node of the plate belongs.
    frames : tuple of Frame
        Coordinate frames of all bodies; each has three motions (x, y, rotation).
    bodies, turning : tuple
        Condensed bodies for small motions, and the same bodies for large rotations.
    ends : tuple of (int, int)
        Indices of the two frames that each flexure joins.
    held : tuple of int
        Indices of the frame motions that supports fix; frame i has the motions 3 i to 3 i + 2.
    by_drive : tuple of dict of int to float
        Frame motions that every drive prescribes, per 1 mm of its own motion.
    """

    plate: PlaneStressPlate
    piece: Indices
    frames: tuple[Frame, ...]
    bodies: tuple[CondensedBody, ...]
    turning: tuple[CorotationalBody, ...]
    ends: tuple[tuple[int, int], ...]
    held: tuple[int, ...]
    by_drive: tuple[dict[int, float], ...]

    def field(self, moved: Array, nodes: Indices) -> tuple[Array, csr_matrix]:
        """Displacement of nodes in the deformed shape (x and y of each), and its derivative by the frames' motions."""
        plate = self.plate
        field = np.zeros((nodes.size, 2))
        slopes = lil_matrix((2 * nodes.size, moved.size))
        for number in np.unique(self.piece[nodes]).tolist():
            body, turning = self.bodies[number], self.turning[number]
            here = np.flatnonzero(self.piece[nodes] == number)
            own = moved[body.unknowns]
            local, by_motion = turning.strained(own), turning.slope(own)
            turn = turned_axes(float(own[2]))
            bent = np.stack([body.shapes_mm[dofs[nodes[here]]] for dofs in (plate.x_dofs, plate.y_dofs)])
            rest = plate.nodes_mm[:, nodes[here]]
            arm = turn @ (rest - turning.places_mm[0][:, None] + bent @ local)
            field[here] = (arm + (turning.places_mm[0] + own[:2])[:, None] - rest).T
            slope = np.einsum("ij,jnk->ink", turn, bent @ by_motion)
            slope[0, :, 0] += 1.0
            slope[1, :, 1] += 1.0
            slope[0, :, 2] -= arm[1]
            slope[1, :, 2] += arm[0]
            for axis in (0, 1):
                slopes[np.ix_(2 * here + axis, body.unknowns)] = slope[axis]
        return field.ravel(), csr_matrix(slopes)

    def small_field(self, moved: Array, own: Sequence[OwnModes] = ()) -> Array:
        """Small displacements of all nodes of the plate by motions of the frames and, after them, of own modes."""
        found = sum(body.shapes_mm @ moved[body.unknowns] for body in self.bodies)
        at = moved.shape[0] - sum(modes.squared.size for modes in own)
        for modes in own:
            found = found + modes.shapes_mm @ moved[at : at + modes.squared.size]
            at += modes.squared.size
        return np.asarray(found)

    def motion_mm(self, moved: Array, point: PointMm, own: Sequence[OwnModes] = (), *, large: bool) -> Array:
        """Displacement of a point of the nearest body, shape (2,), or of every column of small displacements (mm)."""
        plate = self.plate
        nodes, weights = plate.weights_at(point)
        number = int(self.piece[nodes[0]])
        body, turning = self.bodies[number], self.turning[number]
        dofs = plate.x_dofs[nodes], plate.y_dofs[nodes]
        rows = np.stack([weights @ body.shapes_mm[part] for part in dofs])
        motion = moved[body.unknowns]
        if not large:
            found = rows @ motion
            if own:
                at = moved.shape[0] - sum(modes.squared.size for modes in own[number:])
                shapes = own[number].shapes_mm
                inner = moved[at : at + own[number].squared.size]
                found = found + np.stack([weights @ shapes[part] for part in dofs]) @ inner
            return np.asarray(found)
        first, rest = turning.places_mm[0], np.array(point)
        turn = turned_axes(float(motion[2]))
        return np.asarray(first + motion[:2] + turn @ (rest + rows @ turning.strained(motion) - first) - rest)


class _Frames:
    """Collects the coordinate frames of all bodies, the body of each frame, and the fixed and driven motions."""

    def __init__(self, plate: PlaneStressPlate, mechanism: Mechanism, size_mm: float) -> None:
        self.plate, self.mechanism, self.size_mm = plate, mechanism, size_mm
        self.piece = pieces_of(plate)
        self.found: list[Frame] = []
        self.owner: list[int] = []
        self.held: list[int] = []
        self.by_drive: list[dict[int, float]] = []
        self._taken: set[int] = set()

    def add(self, frame: Frame, body: int) -> int:
        """Add a coordinate frame to those of a body; return the index of the first of its three motions."""
        self.found.append(frame)
        self.owner.append(body)
        return 3 * len(self.found) - 3

    def face(self, nodes: Indices, tied: tuple[str, ...], driven: Face | None = None) -> list[tuple[int, bool]]:
        """Add the coordinate frames of a face, one for each body that the face touches.

        Return, for each coordinate frame, the index of its first motion and whether the face's tied components prevent
        rotation.
        """
        added = []
        pieces = np.unique(self.piece[nodes]).tolist()
        if driven is not None and driven.is_pin and len(pieces) > 1:
            raise ModelError(f"pin {driven.name} of {self.mechanism.name} must lie on one body, but touches several.")
        for body in pieces:
            own = nodes[self.piece[nodes] == body]
            weights = None if driven is None else drive_weights(self.plate, own, driven)
            frame, turns = face_frame(self.plate, own, tied, self._taken, weights)
            added.append((self.add(frame, body), turns))
        return added

    def supports(self) -> None:
        """Add the coordinate frames of fixed, driven and sliding faces, and note the fixed and driven motions."""
        mechanism = self.mechanism
        supports = supports_of(self.plate, mechanism, self.size_mm)
        for nodes in supports.fixed:
            for at, turns in self.face(nodes, ("x", "y")):
                self.held += [at, at + 1] + [at + 2] * turns
        for drive, nodes in zip(mechanism.drives, supports.driven, strict=True):
            kept = driven_components(drive)
            own: dict[int, float] = {}
            in_the_mean = moves_in_the_mean(self.plate, nodes, drive)
            for at, turns in self.face(nodes, () if in_the_mean else kept, drive.face):
                own |= {at + "xy".index(c): drive.direction["xy".index(c)] for c in kept}
                own |= {at + 2: 0.0} if turns or drive.turns == "held" else {}
            self.by_drive.append(own)
        for nodes, component in supports.slides:
            for at, turns in self.face(nodes, (component,)):
                self.held += [at + "xy".index(component)] + [at + 2] * turns

    def contacts(self) -> None:
        """Add coordinate frames for the nodes of contact faces, so that contact forces can deform the bodies."""
        for contact in self.mechanism.contacts:
            for face in (contact.face, contact.other):
                if face is not None:
                    self.face(nodes_on(self.plate, face, self.mechanism, self.size_mm), ())

    def cuts(self, span: FlexureSpan) -> tuple[int, int]:
        """Add the coordinate frames of the two sections where a flexure is cut from the bodies that it joins."""
        angle = np.radians(span.flexure.axis_deg)
        axis = np.array([np.cos(angle), np.sin(angle)])
        ends = []
        for cut_mm, height_mm in zip(span.cut_mm, span.heights_mm, strict=True):
            at_mm = np.array(span.flexure.section_mm(cut_mm))
            frame = section_frame(self.plate, at_mm, axis, _OVER * height_mm, _NEAR * self.size_mm)
            ends.append(self.add(frame, int(self.piece[nodes_of(self.plate, frame)[0]])) // 3)
        return ends[0], ends[1]


def assemble_bodies(
    plate: PlaneStressPlate, mechanism: Mechanism, spans: tuple[FlexureSpan, ...], size_mm: float
) -> BodyAssembly:
    """Condense every body to coordinate frames at its supports, contact faces and flexure ends.

    Raises
    ------
    ModelError
        If no node lies on a face, or a body is joined to nothing.
    """
    frames = _Frames(plate, mechanism, size_mm)
    frames.supports()
    frames.contacts()
    ends = tuple(frames.cuts(span) for span in spans)
    piece, owner = frames.piece, np.array(frames.owner)
    bodies = []
    for body in range(int(piece.max()) + 1):
        own = np.flatnonzero(owner == body).tolist()
        nodes = np.flatnonzero(piece == body)
        if not own:
            x, y = plate.nodes_mm[:, nodes[0]]
            raise ModelError(f"The body of {mechanism.name} at ({x:.4g}, {y:.4g}) mm is not joined to any other body.")
        unknowns = np.concatenate([plate.x_dofs[nodes], plate.y_dofs[nodes]])
        bodies.append(condensed(plate, unknowns, [frames.found[i] for i in own], own))
    turning = [CorotationalBody(np.array([frames.found[i].at_mm for i in body.frames]), body.stiffness_n_mm)
               for body in bodies]  # fmt: skip
    return BodyAssembly(plate, piece, tuple(frames.found), tuple(bodies), tuple(turning), ends, tuple(frames.held),
                        tuple(frames.by_drive))  # fmt: skip


# Vibration of a lumped mechanism: condensed bodies with their own modes, joined by flexures with mass.
#
# The bodies' own vibration modes with fixed frames are added to the condensed motions (Craig and Bampton, AIAA Journal
# 6 (1968) 1313). The unknowns are the motions of all coordinate frames, followed by the amplitudes of the bodies' own
# modes.


@dataclass(frozen=True, slots=True)
class SegmentMass:
    """Mass (t) of a flexure's segment of a given length, divided between the coordinate frames at its two ends."""

    ends: tuple[int, int]
    mass_t: float
    length_mm: float


def frame_vibration(
    assembly: BodyAssembly, driven: DrivenMechanism, masses: Sequence[SegmentMass], count: int
) -> tuple[tuple[OwnModes, ...], DrivenMechanism]:
    """Add masses, and `count` own modes of every body, to the equations of frames joined by flexures.

    Parameters
    ----------
    assembly : BodyAssembly
        The condensed bodies.
    driven : DrivenMechanism
        The equations of the frames' motions.
    masses : sequence of SegmentMass
        Masses of the flexures' segments.
    count : int
        Number of own modes of every body.

    Returns
    -------
    tuple of OwnModes, DrivenMechanism
        The own modes of every body, and the system of all unknowns.
    """
    inner = tuple(own_modes(assembly.plate, body, count) for body in assembly.bodies)
    squared = np.concatenate([own.squared for own in inner])
    size, more = driven.unknowns, squared.size
    mass = np.zeros((size + more, size + more))
    at = size
    for body, modes in zip(assembly.bodies, inner, strict=True):
        dofs, own = body.unknowns, np.arange(at, at + modes.squared.size)
        mass[np.ix_(dofs, dofs)] += body.mass_t
        mass[own, own] = 1.0
        mass[np.ix_(dofs, own)], mass[np.ix_(own, dofs)] = modes.coupling_t, modes.coupling_t.T
        at += own.size
    for segment in masses:
        for node in segment.ends:
            place = np.arange(3 * node, 3 * node + 3)
            mass[place, place] += 0.5 * segment.mass_t * np.array([1.0, 1.0, segment.length_mm**2 / 12.0])

    def tangent(moved: Array) -> tuple[csr_matrix, Array]:
        stiffness, force = driven.tangent(moved[:size])
        whole = block_diag([stiffness, diags(squared)], format="csr") if more else stiffness
        return csr_matrix(whole), np.append(force, squared * moved[size:])

    def with_more(gaps: Callable[[Array], Gaps], moved: Array) -> Gaps:
        gap, slope, bend = gaps(moved[:size])
        return (
            gap,
            csr_matrix(hstack([slope, csr_matrix((gap.size, more))])),
            lambda forces: csr_matrix(block_diag([bend(forces), csr_matrix((more, more))])),
        )

    actuators = driven.actuators
    if actuators is not None:
        rows = np.vstack([actuators.rows, np.zeros((more, actuators.rows.shape[1]))])
        actuators = replace(actuators, rows=rows)
    return inner, replace(
        driven,
        actuators=actuators,
        tangent=tangent,
        internal=lambda moved: tangent(moved)[1],
        motions=csr_matrix(block_diag([driven.motions, identity(more)])),
        by_drive=np.vstack([driven.by_drive, np.zeros((more, driven.by_drive.shape[1]))]),
        mass=lambda: csr_matrix(mass),
        gaps=tuple(partial(with_more, gaps) for gaps in driven.gaps),
    )

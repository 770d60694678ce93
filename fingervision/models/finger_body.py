"""The gripper's finger, from both hinges to the tip, as one elastic body condensed from plane finite elements.

Slender bars would model the junction of root, cross bar, shuttle and finger badly, because the pieces between the
points where the axes meet are as wide as they are long. With slender bars, the force on a gripped part would be up to a
third too low. The body is cut from the drawing at the ends of the notches, meshed, and condensed statically (Guyan,
AIAA Journal 3 (1965) 380) to the motions of the cuts, of the tip's inner face, and of a few patches in between, which
carry the body's mass. The remaining nodes of the bar model follow the body's motion; they are used for pictures and
poses.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from fingervision.domain.gripper import Body, Gripper, Hinge, Lever, Links, Material, PointMm
from fingervision.models.body_frames import Frame, face_frame, nodes_of, pieces_of, section_frame
from fingervision.models.condensed_bodies import condensed
from fingervision.models.corotational_body import CorotationalBody
from fingervision.models.flexure_span import FlexureSpan, span_of
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.hinge_compliance import bar_compliance
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_faces import nodes_on
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Polygon, Shape, bar
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.skeleton import Skeleton
from fingervision.models.triangulate import triangulate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_OTHERS = ("pillar", "hinge 1", "hinge 2", "shuttle", "drive block")
"""Names of the members of the half gripper that do not belong to the finger."""
_BLOCK = 2
"""Index of the drive block among the shapes of a half gripper."""
_ON_FACE = ("tip's corner", "tip's heel", "measuring point")
_ACROSS, _EDGE = 2.0, 0.05
"""Triangles across thin parts, and edge length over the body's size, as for the bodies of a mechanism."""
_NEAR, _OVER = 1e-7, 1.1
_BEYOND = 1.04
"""Width of the strip removed behind a hinge, as a multiple of the link's width."""
_PATCH = 0.5
"""Radius of a patch whose mean motion represents a section, as a share of the member's width."""
_LEAST_NODES = 6
_FOLLOWED = 12
"""Number of mesh nodes, the nearest ones, whose mean rigid motion a node of the bar model follows."""
_STIFF = 1e-3
"""Compliance of the springs that tie a node of the bar model to the body, relative to that of a square of the finger's
width. The springs carry contact loads only."""
_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])
_MOST_KEPT = 32
_UNIT = Material("unit", 1.0, 0.3, 1.0, 1.0)
_BODY = Body(1.0, 1.0, 1.0, 0.0, 0.0)
"""Placeholder body: its values do not influence where the hinges end."""


@dataclass(frozen=True, slots=True)
class _Station:
    """A node of the bar model: name of the member that ends there, position, and the member's width."""

    name: str
    at_mm: PointMm
    width_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class FingerBody:
    """The finger as one elastic body, described at the nodes of the bars that it replaces.

    Parameters
    ----------
    nodes : ndarray of int, shape (m,)
        Node numbers in the tree of members (member i ends at node i + 1). The body's axes rotate with the first node.
    turning : CorotationalBody
        Stiffness of the nodes; nodes without mass and load follow the other nodes.
    mass_t : ndarray of float, shape (3 m, 3 m)
        Mass matrix for the nodes' motions.
    """

    nodes: Indices
    turning: CorotationalBody
    mass_t: Array

    @property
    def unknowns(self) -> Indices:
        """Indices of the unknowns of the finger's nodes: x, y, rotation of each node."""
        return np.asarray((3 * self.nodes[:, None] + np.arange(3)).ravel())


def finger_body(gripper: Gripper, skeleton: Skeleton) -> FingerBody:
    """Condense the finger of a drawing; the mesh is reused if only modulus, density or plate thickness differ.

    Raises
    ------
    DataError, ModelError
        If the hinges do not separate the finger from the rest.
    """
    members = skeleton.members
    places = [place for place, member in enumerate(members) if is_of_finger(member.name)]
    first = members[places[0]]
    nodes = np.array([first.parent + 1, *(place + 1 for place in places)])
    stations = (
        _Station("root", first.start_mm, first.width_mm),
        *(_Station(members[place].name, members[place].end_mm, members[place].width_mm) for place in places),
    )
    material, plate_mm = gripper.material, gripper.body.plate_mm
    unit_body = replace(gripper.body, plate_mm=1.0)
    order, stiffness, mass = _unit_body(
        unit_body, gripper.hinge, gripper.lever, gripper.links, material.poisson_ratio, stations
    )
    at_mm = np.array([stations[i].at_mm for i in order])
    scale = material.youngs_modulus_mpa * plate_mm
    turning = CorotationalBody(at_mm, scale * stiffness)
    return FingerBody(nodes[order], turning, material.density_kg_m3 * plate_mm * mass)


def finger_ends_mm(gripper: Gripper) -> tuple[float, float]:
    """Distances from the centres of hinges 1 and 2 to the cuts at which the finger begins (mm)."""
    first, second = _spans(gripper.hinge, gripper.lever, gripper.links)
    return first.cut_mm[1], second.cut_mm[1]


def is_of_finger(name: str) -> bool:
    """Whether a member of the half gripper, given by its name, is part of the finger."""
    return name not in _OTHERS


@lru_cache(maxsize=_MOST_KEPT)
def _unit_body(
    body: Body, hinge: Hinge, lever: Lever, links: Links, poisson: float, stations: tuple[_Station, ...]
) -> tuple[Indices, Array, Array]:
    """Return the order of the kept nodes; stiffness and mass for unit modulus, density (kg/m^3) and plate thickness."""
    gripper = Gripper(Material("unit", 1.0, poisson, 1.0, 1.0), body, hinge, lever, links)
    mechanism = half_mechanism(gripper)
    spans = _spans(hinge, lever, links)
    size = mechanism.region.size_mm
    plate = PlaneStressPlate(
        triangulate(_finger_region(mechanism, spans), _ACROSS, _EDGE * size), gripper.material, 1.0
    )
    pieces = pieces_of(plate)
    finger = pieces == pieces[int(np.argmin(np.hypot(*(plate.nodes_mm - np.array(gripper.tip_corner_mm)[:, None]))))]
    frames, kept = _frames(plate, finger, mechanism, spans, stations, size)
    unknowns = np.concatenate([plate.x_dofs[finger], plate.y_dofs[finger]])
    whole = condensed(plate, unknowns, frames, range(len(frames)))
    # Motion of every station from the motions of the kept nodes: stations on the face rotate with the face, the other
    # stations follow the body.
    followers = [i for i in range(len(stations)) if i not in kept]
    ties = np.array([_tie(plate, finger, whole.shapes_mm, stations, kept, i) for i in followers])
    ties = ties.reshape(3 * len(followers), 3 * len(kept))
    side = links.finger_width_mm
    spring = np.linalg.inv(_STIFF * bar_compliance(side, side, 1.0, gripper.material)[_PLANAR])
    springs = np.kron(np.eye(len(followers)), spring)
    stiffness = np.block([[whole.stiffness_n_mm + ties.T @ springs @ ties, -ties.T @ springs],
                          [-springs @ ties, springs]])  # fmt: skip
    mass = np.zeros_like(stiffness)
    mass[: 3 * len(kept), : 3 * len(kept)] = whole.mass_t
    return np.array([*kept, *followers]), stiffness, mass


@lru_cache(maxsize=_MOST_KEPT)
def _spans(hinge: Hinge, lever: Lever, links: Links) -> tuple[FlexureSpan, ...]:
    """Find where each of the two hinges is cut from the bodies that it joins."""
    mechanism = half_mechanism(Gripper(_UNIT, _BODY, hinge, lever, links))
    region = mechanism.region
    return tuple(span_of(flexure, region) for flexure in mechanism.flexures)


def _finger_region(mechanism: Mechanism, spans: tuple[FlexureSpan, ...]) -> PlanarRegion:
    """Region of the finger: the drawing without the drive block, the flexures and the bodies at their other ends."""
    far = 2.0 * mechanism.region.size_mm
    steps: list[tuple[bool, Shape]] = [*mechanism.bodies[:_BLOCK], *mechanism.bodies[_BLOCK + 1 :]]
    steps += [step for flexure in mechanism.flexures for step in flexure.steps()]
    for span, width_mm in zip(spans, _link_widths_mm(mechanism), strict=True):
        flexure = span.flexure
        behind = bar(*flexure.at_mm, *flexure.point_mm(-far, 0.0), _BEYOND * width_mm)
        steps += [(False, span.slab), (False, behind)]
    return PlanarRegion(tuple(steps), mechanism.region.marks_mm)


def _link_widths_mm(mechanism: Mechanism) -> list[float]:
    """Widths of the links into which the hinges are cut, each measured across its hinge's axis (mm)."""
    widths = []
    for (_, shape), flexure in zip(mechanism.bodies, mechanism.flexures, strict=False):
        corners = np.array(shape.corners_mm) if isinstance(shape, Polygon) else np.zeros((1, 2))
        angle = np.radians(flexure.axis_deg)
        across = (corners - flexure.at_mm) @ np.array([-np.sin(angle), np.cos(angle)])
        widths.append(2.0 * float(np.abs(across).max()))
    return widths


def _frames(
    plate: PlaneStressPlate,
    finger: NDArray[np.bool_],
    mechanism: Mechanism,
    spans: tuple[FlexureSpan, ...],
    stations: tuple[_Station, ...],
    size_mm: float,
) -> tuple[list[Frame], list[int]]:
    """Coordinate frames of the kept nodes (two cuts, the face, patches in between), and the indices of these nodes."""
    names = [station.name for station in stations]
    cuts = [0, len(names) - 1 - names[::-1].index("stub")]
    face = names.index("measuring point")
    found: list[Frame] = []
    for span, place in zip(spans, cuts, strict=True):
        angle = np.radians(span.flexure.axis_deg)
        at_mm = np.array(span.flexure.point_mm(span.cut_mm[1], 0.0))
        axis = np.array([np.cos(angle), np.sin(angle)])
        frame = section_frame(plate, at_mm, axis, _OVER * span.heights_mm[1], _NEAR * size_mm)
        found.append(_moved(frame, stations[place].at_mm))
    on_face = nodes_on(plate, mechanism.contacts[0].face, mechanism, size_mm)
    found.append(_moved(face_frame(plate, on_face, (), set())[0], stations[face].at_mm))
    kept = [*cuts, face]
    taken = np.zeros(finger.size, dtype=bool)
    for frame in found:
        taken[nodes_of(plate, frame)] = True
    for place, station in enumerate(stations):
        apart = np.hypot(*(plate.nodes_mm - np.array(station.at_mm)[:, None]))
        within = (apart < _PATCH * station.width_mm) & finger
        if station.name in _ON_FACE or within.sum() < _LEAST_NODES or taken[within].any():
            continue
        taken |= within
        found.append(_patch_frame(plate, np.flatnonzero(within), station.at_mm))
        kept.append(place)
    return found, kept


def _moved(frame: Frame, to_mm: PointMm) -> Frame:
    """Express a coordinate frame by the motion of another point of the same rigid section."""
    arm = frame.at_mm - np.array(to_mm)
    carried = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]])
    return Frame(np.array(to_mm), frame.rows, frame.motion @ carried)


def _patch_frame(plate: PlaneStressPlate, nodes: Indices, at_mm: PointMm) -> Frame:
    """Coordinate frame with the mean motion of a patch: the rigid motion nearest to that of the patch's nodes."""
    rigid = _rigid(plate, nodes, at_mm)
    fit = np.linalg.pinv(rigid)
    rows = np.zeros((3, plate.unknowns))
    rows[:, plate.x_dofs[nodes]], rows[:, plate.y_dofs[nodes]] = fit[:, : nodes.size], fit[:, nodes.size :]
    return Frame(np.array(at_mm), csr_matrix(rows), np.eye(3))


def _rigid(plate: PlaneStressPlate, nodes: Indices, at_mm: PointMm) -> Array:
    """Displacements of nodes (all x, then all y) for unit rigid motions about a point, shape (2 k, 3)."""
    x, y = plate.nodes_mm[:, nodes] - np.array(at_mm)[:, None]
    one, zero = np.ones(nodes.size), np.zeros(nodes.size)
    return np.vstack([np.column_stack([one, zero, -y]), np.column_stack([zero, one, x])])


def _tie(
    plate: PlaneStressPlate,
    finger: NDArray[np.bool_],
    shapes_mm: Array,
    stations: tuple[_Station, ...],
    kept: list[int],
    place: int,
) -> Array:
    """Matrix from the motions of the kept nodes to the motion of a node that follows them, shape (3, 3 k)."""
    station = stations[place]
    tie = np.zeros((3, shapes_mm.shape[1]))
    if station.name in _ON_FACE:
        on_face = next(i for i in kept if stations[i].name == "measuring point")
        arm = np.subtract(station.at_mm, stations[on_face].at_mm)
        at = 3 * kept.index(on_face)
        tie[:, at : at + 3] = [[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]]
        return tie
    apart = np.hypot(*(plate.nodes_mm - np.array(station.at_mm)[:, None]))
    apart[~finger] = np.inf
    near = np.argsort(apart)[:_FOLLOWED]
    moved = np.vstack([shapes_mm[plate.x_dofs[near]], shapes_mm[plate.y_dofs[near]]])
    return np.asarray(np.linalg.pinv(_rigid(plate, near, station.at_mm)) @ moved)

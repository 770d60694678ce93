"""Nodes of a meshed mechanism that are fixed, slide or are driven, and a test whether these supports suffice."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.csgraph import connected_components

from fingervision.domain.errors import DataError
from fingervision.models.mechanism import Contact, Drive, Face, Mechanism
from fingervision.models.mechanism_equilibrium import Actuators, DrivenMechanism
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.strips import necks_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ON = 1e-7
"""Distance from a face's box within which a node counts as lying on the face, as a share of the body's size."""

_PIN_POINTS = 61
"""Points in a pin's circle; with four times as many, the stiffness of a lever changes by less than 1e-3."""
_OUTSIDE = -1e-9
"""Least value of the shape functions of a quadratic triangle's edges inside it (0, with rounding): they are four times
the product of two barycentric coordinates."""
_LEVER = 1e-6
"""Lever arms across a component that are shorter than this share of the face's extent do not prevent rotation."""
_RIGIDLY = 1e-6
"""Largest difference between the motion that a drive prescribes and the nearest motion of a rigid body, over it."""
_SLENDER = 5.0
"""Length over width, straightened, from which a body bends as a beam, so that its own deformation is an answer: a
cantilever's stiffness is then within 3 %, the models' error of a force, of 3 E I / L^3 (at 3 times 8 % lower)."""


def nodes_on(plate: PlaneStressPlate, face: Face, mechanism: Mechanism, size_mm: float) -> Indices:
    """Nodes of the outline inside a face's box; for a pin, the nodes that its mean motion depends on.

    Raises
    ------
    DataError
        If no part of the outline lies in the box.
    """
    if face.is_pin:
        return _within_pin(plate, face)[0]
    outline = np.unique(plate.outline_edges)
    nodes = outline[face.holds(plate.nodes_mm[:, outline], _ON * size_mm)]
    if nodes.size < 2:
        x0, x1, y0, y1 = face.box_mm
        raise DataError(
            f"face {face.name} of {mechanism.name} must hold a part of the outline, but its box "
            f"[{x0:g}, {x1:g}, {y0:g}, {y1:g}] mm holds none."
        )
    return np.asarray(nodes)


def _within_pin(plate: PlaneStressPlate, face: Face) -> tuple[Indices, Array]:
    """Nodes and their weights in the mean motion of the body within a pin's circle.

    The points of the mean fill the circle evenly (a spiral with the golden angle); those outside the body are left out.
    """
    x0, x1, _, _ = face.box_mm
    place = np.arange(_PIN_POINTS)
    radius, angle = 0.5 * (x1 - x0) * np.sqrt((place + 0.5) / _PIN_POINTS), place * np.pi * (3.0 - np.sqrt(5.0))
    points = np.array(face.middle_mm)[:, None] + radius * np.stack([np.cos(angle), np.sin(angle)])
    found = [plate.weights_at((float(x), float(y))) for x, y in points.T]
    inside = [(nodes, weights) for nodes, weights in found if weights[3:].min() > _OUTSIDE] or found[:1]
    total = np.zeros(plate.x_dofs.size)
    for nodes, weights in inside:
        total[nodes] += weights / len(inside)
    kept = np.flatnonzero(total)
    return kept, total[kept]


def drive_weights(plate: PlaneStressPlate, nodes: Indices, face: Face) -> Array:
    """Weights of a driven face's nodes in its mean motion, shape (k,), with sum 1."""
    return _within_pin(plate, face)[1] if face.is_pin else mean_weights(plate, nodes)


def mean_weights(plate: PlaneStressPlate, nodes: Indices) -> Array:
    """Weights of the nodes in the mean motion of a face (those of a uniform load), shape (k,), with sum 1."""
    edges = plate.outline_edges[:, np.all(np.isin(plate.outline_edges, nodes), axis=0)]
    x, y = plate.nodes_mm
    length = np.hypot(x[edges[1]] - x[edges[0]], y[edges[1]] - y[edges[0]])
    total = np.zeros(x.size)
    for row, share in zip(edges, (1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0), strict=True):
        np.add.at(total, row, share * length)
    weights = total[nodes]
    return np.asarray(weights / weights.sum() if weights.sum() > 0.0 else np.full(nodes.size, 1.0 / nodes.size))


def moves_in_the_mean(plate: PlaneStressPlate, nodes: Indices, drive: Drive) -> bool:
    """Whether a drive prescribes the mean motion of its face, not the motion of every node.

    A face that may turn moves in the mean. So does a face that may slide and is parallel to its drive, because
    prescribing the motion along it at every node would let it rotate by stretching alone; `turns` then decides whether
    its mean rotation is free.
    """
    return drive.turns == "free" or not keeps_from_turning(plate.nodes_mm[:, nodes], driven_components(drive))


def keeps_from_turning(places_mm: Array, components: Sequence[str]) -> bool:
    """Whether a face cannot turn if its nodes, shape (2, k), follow a rigid body in some components of their motion."""
    spread = np.ptp(places_mm, axis=1)
    return any(spread["yx".index(component)] > _LEVER * np.hypot(*spread) for component in components)


def driven_components(drive: Drive) -> tuple[str, ...]:
    """Components that a drive prescribes: x and y if the face is guided, else that of the drive."""
    if drive.across == "held":
        return "x", "y"
    return ("x",) if drive.direction[0] != 0.0 else ("y",)


def with_actuators(system: DrivenMechanism, rows: Array, mechanism: Mechanism) -> DrivenMechanism:
    """Add the preloads and the soft actuators of a drawing, if any, to the equations of its driven faces.

    Parameters
    ----------
    system : DrivenMechanism
        The mechanism with the motions of its driven faces prescribed.
    rows : ndarray of float, shape (unknowns, drives)
        Weights of the unknowns in the motion of every driven face along its direction.
    mechanism : Mechanism
        The drawing.

    Raises
    ------
    ModelError
        If the mechanism gives way under its preload.
    """
    drives = mechanism.drives
    preload_n = np.array([drive.preload_n for drive in drives])
    if preload_n.any():
        bare = replace(mechanism, drives=tuple(replace(drive, preload_n=0.0) for drive in drives))
        pressed = with_actuators(system.preloaded(rows, preload_n), rows, bare)
        return replace(pressed, unloaded=with_actuators(system, rows, bare))
    soft = np.array([drive.is_soft for drive in drives])
    if not soft.any():
        return system
    spring = np.array([drive.spring_n_mm for drive in drives])
    push = np.array([drive.push_n for drive in drives])
    return system.actuated(Actuators(np.where(soft, rows, 0.0), spring, push), soft)


def per_input_of(mechanism: Mechanism) -> Array:
    """Motion of every driven face per 1 mm of input, shape (drives,)."""
    return np.array([drive.per_input for drive in mechanism.drives])


@dataclass(frozen=True, slots=True, eq=False)
class Supports:
    """Nodes on the supported and driven faces of a mechanism.

    Parameters
    ----------
    fixed : tuple of ndarray of int
        Nodes of every fixed face.
    slides : tuple of (ndarray of int, str)
        Nodes of every sliding face, with the component that is fixed.
    driven : tuple of ndarray of int
        Nodes of every driven face.
    """

    fixed: tuple[Indices, ...]
    slides: tuple[tuple[Indices, str], ...]
    driven: tuple[Indices, ...]


def supports_of(plate: PlaneStressPlate, mechanism: Mechanism, size_mm: float) -> Supports:
    """Find the nodes on every supported or driven face.

    Raises
    ------
    DataError
        If a face contains no node, a driven face is fixed or shares nodes with another one, or no face is fixed.
    """
    fixed = tuple(nodes_on(plate, face, mechanism, size_mm) for face in mechanism.fixed)
    slides = tuple((nodes_on(plate, face, mechanism, size_mm), held) for face, held in mechanism.slides)
    driven = tuple(nodes_on(plate, drive.face, mechanism, size_mm) for drive in mechanism.drives)
    if not fixed and not slides and len(driven) == 1:
        raise DataError(f"{mechanism.name} must have a [[fixed]] face, but has none.")
    held = {"x": list(fixed), "y": list(fixed)}
    for nodes, component in slides:
        held[component].append(nodes)
    for place, (drive, own) in enumerate(zip(mechanism.drives, driven, strict=True)):
        for component, share in zip("xy", drive.direction, strict=True):
            both = component in driven_components(drive) and any(np.intersect1d(n, own).size for n in held[component])
            if both and share * drive.per_input != 0.0:
                raise DataError(
                    f"The drive of {mechanism.name} must be free to move, but its face {drive.face.name} is fixed too."
                )
        for other, theirs in zip(mechanism.drives[:place], driven[:place], strict=True):
            if np.intersect1d(own, theirs).size:
                raise DataError(
                    f"Driven faces {other.face.name} and {drive.face.name} of {mechanism.name} must be apart, but "
                    "share a part of the outline; shorten one of their boxes, or leave one of them out."
                )
    supports = Supports(fixed, slides, driven)
    _refuse_held_bodies(plate, mechanism, supports)
    return supports


def pieces_of(plate: PlaneStressPlate, kept: NDArray[np.bool_] | slice = slice(None)) -> Indices:
    """Number the connected parts of a mesh, or of some of its triangles; return the number of every node's part."""
    nodes = plate.nodes_of_triangles[:, kept]
    rows, columns = np.repeat(nodes[0], 6), nodes.T.ravel()
    count = plate.x_dofs.size
    graph = coo_matrix((np.ones(rows.size), (rows, columns)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _refuse_held_bodies(plate: PlaneStressPlate, mechanism: Mechanism, supports: Supports) -> None:
    """Refuse a drive whose body its supports and other drives hold: it deforms the body, and moves no flexure.

    A slender body bends, and a body with a thin part that no flexure names may move by this part.

    Raises
    ------
    DataError
        If no motion of a rigid body agrees with what the faces of the driven body prescribe.
    """
    flexures, drives = mechanism.flexures, mechanism.drives
    if not flexures:
        return
    middles = plate.nodes_mm[:, plate.corner_triangles].mean(axis=1)
    thin = np.any([flexure.zone(mechanism.plate_mm).holds(middles) for flexure in flexures], axis=0)
    piece = pieces_of(plate, ~thin if plate.pieces is None else slice(None))
    faces: list[tuple[Face, Indices, tuple[str, ...], Drive | None]] = [
        *((face, nodes, ("x", "y"), None) for face, nodes in zip(mechanism.fixed, supports.fixed, strict=True)),
        *(
            (face, nodes, (held,), None)
            for (face, held), (nodes, _) in zip(mechanism.slides, supports.slides, strict=True)
        ),
        *((d.face, nodes, driven_components(d), d) for d, nodes in zip(drives, supports.driven, strict=True)),
    ]
    for drive, driven in zip(drives, supports.driven, strict=True):
        body = np.bincount(piece[driven]).argmax()
        own = [(face, nodes[piece[nodes] == body], *how) for face, nodes, *how in faces]
        conditions = [(face.name, *_rigid_conditions(plate, nodes, *how)) for face, nodes, *how in own if nodes.size]
        names, rows, values = zip(*conditions, strict=True)
        wanted, all_rows = np.concatenate(values), np.concatenate(rows)
        left = all_rows @ np.linalg.lstsq(all_rows, wanted, rcond=None)[0] - wanted
        if np.abs(left).max() <= _RIGIDLY * np.abs(wanted).max():
            continue
        (x1, x2, x3), (y1, y2, y3) = plate.nodes_mm[
            :, plate.corner_triangles[:, piece[plate.corner_triangles[0]] == body]
        ]
        area = 0.5 * np.abs((x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)).sum()
        sides = plate.nodes_mm[:, plate.outline_edges[:2, piece[plate.outline_edges[2]] == body]]
        # A strip of length L and width h has the perimeter 2 (L + h), whichever way it is bent.
        if 0.25 * np.hypot(*np.diff(sides, axis=1)[:, 0]).sum() ** 2 / area - 2.0 > _SLENDER:
            continue
        necks = [at for at, _ in necks_of(mechanism.region, flexures)]
        nearest = [np.argmin(np.hypot(*(plate.nodes_mm - np.array([at]).T))) for at in necks]
        if body not in piece[nearest]:
            x, y = drive.face.middle_mm
            raise DataError(
                f"{drive.face.name} of {mechanism.name} must be able to move its body, but the body at ({x:.4g}, "
                f"{y:.4g}) mm is held by {' and '.join(names)} together; drive another body, or let a [[flexure]] "
                "divide it."
            )


def _rigid_conditions(
    plate: PlaneStressPlate, nodes: Indices, components: tuple[str, ...], drive: Drive | None
) -> tuple[Array, Array]:
    """Conditions of a supported or driven face on the motions (x, y, rotation) of its body, and their values."""
    x, y = plate.nodes_mm[:, nodes]
    one, none = np.ones_like(x), np.zeros_like(x)
    motion = {"x": np.stack([one, none, -y], axis=1), "y": np.stack([none, one, x], axis=1)}
    shares, pushed = np.eye(nodes.size), dict.fromkeys(components, 0.0)
    if drive is not None:
        pushed = {c: drive.per_input * drive.direction["xy".index(c)] for c in components}
        shares = np.full((1, nodes.size), 1.0 / nodes.size) if moves_in_the_mean(plate, nodes, drive) else shares
    rows = [shares @ motion[component] for component in components]
    values = [np.full(len(shares), value) for value in pushed.values()]
    if drive is not None and drive.turns == "held":
        rows.append(np.array([[0.0, 0.0, 1.0]]))
        values.append(np.zeros(1))
    return np.concatenate(rows), np.concatenate(values)


# Frictionless contact of two faces of a mechanism: gaps between nodes and segments, and their derivatives.
#
# The method is node-to-segment contact (Wriggers, Computational Contact Mechanics, chapter 9): the gap of a node of
# one face is its distance from the nearest straight segment of the other face, or from a rigid wall.

Bend = Callable[[Array], csr_matrix]

_OVERHANG = 0.05
"""Length by which the touched face is extended at its ends, as a share of its length: a node beyond an end can then
still touch it. Faces that meet corner to corner slide a little past each other and would otherwise lose contact."""
_PENETRATES = 1e-6
"""Overlap of two faces at rest, as a share of the body's size, above which the drawing is refused as wrong."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactNodes:
    """The nodes of a contact alone, without the rest of their mesh.

    Parameters
    ----------
    places : ndarray of int, shape (k,)
        Indices of the nodes in the mesh.
    nodes_mm : ndarray of float, shape (2, k)
        Positions of the nodes at rest; the motion of node i has the components 2 i and 2 i + 1.
    """

    places: Indices
    nodes_mm: Array

    @property
    def x_dofs(self) -> Indices:
        """Components along x."""
        return 2 * np.arange(self.places.size)

    @property
    def y_dofs(self) -> Indices:
        """Components along y."""
        return self.x_dofs + 1

    @property
    def unknowns(self) -> int:
        """Number of components."""
        return 2 * self.places.size


@dataclass(frozen=True, slots=True, eq=False)
class ContactPair:
    """A pair of faces, or a face and a wall, that may touch.

    Parameters
    ----------
    name : str
        Name of the contact in messages and results.
    nodes : ndarray of int, shape (k,)
        Indices of the nodes that may touch.
    segments : ndarray of int, shape (2, s)
        Indices of the two end nodes of each segment of the other face, with the void to the segment's left; empty for a
        wall.
    wall_mm : ndarray of float, shape (2, 2), or None
        Two points of a rigid wall, the void on its left.
    """

    name: str
    nodes: Indices
    segments: Indices
    wall_mm: Array | None

    @property
    def _is_end(self) -> NDArray[np.bool_]:
        """Whether the first and the second node of each segment is an end of the face, shape (2, s)."""
        if self.wall_mm is not None:
            return np.zeros((2, 1), dtype=bool)
        nodes, place, count = np.unique(self.segments, return_inverse=True, return_counts=True)
        del nodes
        return np.asarray(count[place].reshape(self.segments.shape) == 1)

    def alone(self, plate: PlaneStressPlate) -> tuple[ContactNodes, "ContactPair"]:
        """Return the nodes of this contact, and the contact with indices among these nodes."""
        places = np.unique(np.concatenate([self.nodes, self.segments.ravel()]))
        own = replace(self, nodes=np.searchsorted(places, self.nodes), segments=np.searchsorted(places, self.segments))
        return ContactNodes(places, plate.nodes_mm[:, places]), own

    def gaps_mm(self, plate: PlaneStressPlate | ContactNodes, moved: Array) -> tuple[Array, csr_matrix, Bend]:
        """Gap of every node, infinite for a node that faces no segment, with its first and second derivatives.

        Returns
        -------
        ndarray of float, shape (k,)
            Gap of each node (mm).
        sparse matrix, shape (k, unknowns)
            First derivatives of the gaps with respect to the displacements.
        callable
            Maps forces on the nodes to the sum of force times second derivative of the gap, shape (unknowns, unknowns);
            the second derivatives arise because the normal rotates with the other face.
        """
        at = plate.nodes_mm + np.stack([moved[plate.x_dofs], moved[plate.y_dofs]])
        points = at[:, self.nodes]
        if self.wall_mm is not None:
            first, second = self.wall_mm[:, :1], self.wall_mm[:, 1:]
        else:
            first, second = at[:, self.segments[0]], at[:, self.segments[1]]
        chord = second - first
        length = np.hypot(*chord)
        along = chord / length
        apart = points[:, :, None] - first[:, None, :]
        way = np.sum(apart * along[:, None, :], axis=0)
        inside = way
        if self.wall_mm is None:
            past = _OVERHANG * float(length.sum())
            inside = np.clip(way, np.where(self._is_end[0], -past, 0.0), length + np.where(self._is_end[1], past, 0.0))
        distance = np.hypot(*(apart - inside * along[:, None, :]))
        nearest = np.argmin(distance, axis=1)
        row = np.arange(self.nodes.size)
        share = (inside / length)[row, nearest]
        normal = np.stack([-along[1], along[0]])[:, nearest]
        gap = np.sum(apart[:, row, nearest] * normal, axis=0)
        beyond = self._is_end[:, nearest].any(axis=0) & (np.abs(way - inside)[row, nearest] > 1e-9 * length[nearest])
        gap = np.where(beyond, np.inf, gap)
        segments = self.segments[:, nearest] if self.wall_mm is None else np.tile(self.nodes, (2, 1))
        held = self.wall_mm is None
        places = np.stack([self.nodes, *segments])

        def combined(weights: Array, direction: Array) -> csr_matrix:
            """Weighted sums of the motions of a node and its segment's ends along a direction, one row per node."""
            values = weights[:, None, :] * direction[None]
            columns = np.stack([plate.x_dofs[places], plate.y_dofs[places]], axis=1)
            rows = np.broadcast_to(row, values.shape)
            return csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(row.size, plate.unknowns))

        ends = np.stack([np.ones(row.size), (share - 1.0) * held, -share * held])
        slope = combined(ends, normal)

        def bend(forces: Array) -> csr_matrix:
            if not held:
                return csr_matrix((plate.unknowns, plate.unknowns))
            turned = combined(np.stack([np.zeros(row.size), -np.ones(row.size), np.ones(row.size)]), normal)
            slid = combined(ends, along[:, nearest])
            half = turned.T @ diags(-forces / length[nearest]) @ slid
            return csr_matrix(half + half.T)

        return gap, slope, bend


def contact_pair(plate: PlaneStressPlate, contact: Contact, mechanism: Mechanism, size_mm: float) -> ContactPair:
    """Find the nodes and segments of a contact that the drawing defines.

    Raises
    ------
    DataError
        If a face has no node, or the faces overlap at rest, or a wall lies behind its face.
    """
    nodes = nodes_on(plate, contact.face, mechanism, size_mm)
    if contact.wall_mm is not None:
        wall = np.array(contact.wall_mm).T
        middle = plate.nodes_mm[:, nodes].mean(axis=1) - wall[:, 0]
        along = wall[:, 1] - wall[:, 0]
        if along[0] * middle[1] - along[1] * middle[0] < 0.0:
            wall = wall[:, ::-1]
        x, y = plate.nodes_mm
        edges = plate.outline_edges[:, np.all(np.isin(plate.outline_edges, nodes), axis=0)]
        outward = np.array([np.sum(y[edges[0]] - y[edges[1]]), np.sum(x[edges[1]] - x[edges[0]])])
        towards = np.array([wall[1, 1] - wall[1, 0], wall[0, 0] - wall[0, 1]])
        if outward @ towards <= 0.0:
            raise DataError(
                f"The wall of contact {contact.name} of {mechanism.name} must lie in front of its face, but lies "
                "behind the face, where the body is."
            )
        pair = ContactPair(contact.name, nodes, np.zeros((2, 0), dtype=np.int64), wall)
    else:
        wanted = nodes_on(plate, contact.other or contact.face, mechanism, size_mm)
        edges = plate.outline_edges[:, np.all(np.isin(plate.outline_edges, wanted), axis=0)]
        if edges.shape[1] == 0 or np.intersect1d(nodes, wanted).size:
            raise DataError(
                f"contact {contact.name} of {mechanism.name} must be between two separate faces, but part of the "
                "outline belongs to both."
            )
        # The body lies on the right of an edge that runs so that the void is on its left.
        segments = np.hstack([edges[[0, 2]], edges[[2, 1]]])
        pair = ContactPair(contact.name, nodes, segments, None)
    gap, _, _ = pair.gaps_mm(plate, np.zeros(plate.unknowns))
    if gap.min() < -_PENETRATES * size_mm:
        raise DataError(
            f"The faces of contact {contact.name} of {mechanism.name} must be apart or touch at rest, but overlap by "
            f"{-gap.min():.4g} mm."
        )
    return pair

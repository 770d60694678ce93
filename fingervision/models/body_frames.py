"""Coordinate frames to which a meshed body is condensed: each frame has the motion of a cut or of a face."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components

from fingervision.domain.errors import ModelError
from fingervision.models.mechanism_faces import mean_weights
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_LEVER = 1e-6
"""Lever arms shorter than this share of the face's extent do not prevent rotation (measured across a tied
component)."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A coordinate frame with three motions (along x, along y, rotation), coupled to the nodes of a body.

    Parameters
    ----------
    at_mm : ndarray of float, shape (2,)
        Position of the frame's origin.
    rows : sparse matrix, shape (k, unknowns of the plate)
        Linear combinations of the body's displacements that the frame's motion prescribes.
    motion : ndarray of float, shape (k, 3)
        Value of each combination per unit of each of the frame's three motions.
    """

    at_mm: Array
    rows: csr_matrix
    motion: Array


def pieces_of(plate: PlaneStressPlate) -> Indices:
    """Number the connected parts of a mesh; return the part's number for every node, in the order of `nodes_mm`."""
    dofs = plate.unknowns_of_triangles[:, :6]
    place_of = np.empty(plate.unknowns, dtype=np.int64)
    place_of[plate.x_dofs] = np.arange(plate.x_dofs.size)
    nodes = place_of[dofs]
    rows, columns = np.repeat(nodes[:, 0], 6), nodes.ravel()
    count = plate.x_dofs.size
    graph = coo_matrix((np.ones(rows.size), (rows, columns)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def nodes_of(plate: PlaneStressPlate, frame: Frame) -> Indices:
    """Return the nodes whose displacements are coupled to a coordinate frame."""
    place_of = np.empty(plate.unknowns, dtype=np.int64)
    place_of[plate.x_dofs] = place_of[plate.y_dofs] = np.arange(plate.x_dofs.size)
    return np.asarray(place_of[np.unique(frame.rows.nonzero()[1])])


def section_frame(plate: PlaneStressPlate, at_mm: Array, axis: Array, height_mm: float, near_mm: float) -> Frame:
    """Coordinate frame of a section cut perpendicular to an axis.

    The motion of a section's coordinate frame is the mean of the section's displacements, weighted by the stresses of a
    beam: uniform for tension, linear for bending and parabolic for shear over the height.

    Parameters
    ----------
    plate : PlaneStressPlate
        The meshed bodies.
    at_mm : ndarray of float, shape (2,)
        Middle of the section.
    axis : ndarray of float, shape (2,)
        Unit vector of the beam's axis.
    height_mm, near_mm : float
        Height of the section, and the largest distance from the cut at which a node counts as lying on it.
    """
    normal = np.array([-axis[1], axis[0]])
    apart = plate.nodes_mm - at_mm[:, None]
    on = (np.abs(axis @ apart) < near_mm) & (np.abs(normal @ apart) < 0.5 * height_mm + near_mm)
    edges = plate.outline_edges[:, np.all(on[plate.outline_edges], axis=0)]
    if edges.shape[1] == 0:
        raise ModelError(f"A flexure must join a body at ({at_mm[0]:.5g}, {at_mm[1]:.5g}) mm, but does not.")
    points, weights = leggauss(4)
    s = 0.5 * (points + 1.0)
    shape = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)])
    y = shape.T @ (normal @ apart)[edges]
    ends = (normal @ apart)[edges[:2]]
    weight = 0.5 * weights[:, None] * np.abs(ends[1] - ends[0])
    height = float(weight.sum())
    middle = float((weight * y).sum()) / height
    y = y - middle
    second = float((weight * y**2).sum())
    parabola = np.maximum(1.0 - (2.0 * y / height) ** 2, 0.0)
    along = np.zeros((3, plate.x_dofs.size))
    for row, density in enumerate((1.0 / height, parabola / float((weight * parabola).sum()), -y / second)):
        np.add.at(along[row], edges, shape @ (weight * density))
    directions = (axis, normal, axis)
    rows = [_row(plate, d[0] * part, d[1] * part) for d, part in zip(directions, along, strict=True)]
    motion = np.array([[*axis, 0.0], [*normal, 0.0], [0.0, 0.0, 1.0]])
    return Frame(at_mm + middle * normal, csr_matrix(np.vstack(rows)), motion)


def _row(plate: PlaneStressPlate, x_part: Array, y_part: Array) -> Array:
    row = np.zeros(plate.unknowns)
    row[plate.x_dofs], row[plate.y_dofs] = x_part, y_part
    return row


def face_frame(plate: PlaneStressPlate, nodes: Indices, tied: Sequence[str], taken: set[int]) -> tuple[Frame, bool]:
    """Coordinate frame of a face whose nodes follow one component, or both components, of a rigid motion.

    Parameters
    ----------
    plate : PlaneStressPlate
        The bodies.
    nodes : ndarray of int
        Nodes of the face, all of one body.
    tied : sequence of str
        Components (x, y or both) in which every node follows the frame; in the remaining component, only the mean
        motion of the nodes follows the frame.
    taken : set of int
        Unknowns that are already tied to another face; the unknowns of this face are added to the set.

    Returns
    -------
    Frame, bool
        The frame, and whether the tied components keep the face from turning.
    """
    places = plate.nodes_mm[:, nodes]
    at_mm = places.mean(axis=1)
    arms = places - at_mm[:, None]
    extent = float(np.hypot(*arms).max())
    found: list[tuple[dict[int, float], list[float]]] = []
    dofs = {"x": plate.x_dofs[nodes], "y": plate.y_dofs[nodes]}
    levers = {"x": -arms[1], "y": arms[0]}
    for component in tied:
        for dof, lever in zip(dofs[component].tolist(), levers[component].tolist(), strict=True):
            if dof not in taken:
                taken.add(dof)
                found.append(({dof: 1.0}, [float(component == "x"), float(component == "y"), lever]))
    held = turns = any(np.abs(levers[component]).max() > _LEVER * extent for component in tied)
    weights = mean_weights(plate, nodes)
    for component in sorted({"x", "y"} - set(tied)):
        own, lever = dofs[component].tolist(), levers[component]
        mean = dict(zip(own, weights.tolist(), strict=True))
        found.append((mean, [float(component == "x"), float(component == "y"), float(weights @ lever)]))
        if not held and np.abs(lever).max() > _LEVER * extent:
            lever = lever - weights @ lever
            turn = dict(zip(own, (weights * lever / (weights @ lever**2)).tolist(), strict=True))
            found.append((turn, [0.0, 0.0, 1.0]))
            held = True
    rows = [(i, dof, value) for i, (row, _) in enumerate(found) for dof, value in row.items()]
    i, dof, value = zip(*rows, strict=True) if rows else ((), (), ())
    matrix = csr_matrix((value, (i, dof)), shape=(len(found), plate.unknowns))
    return Frame(at_mm, matrix, np.array([motion for _, motion in found]).reshape(-1, 3)), turns

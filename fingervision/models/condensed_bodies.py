"""Elastic bodies condensed to coordinate frames: few unknowns per body, exact for static loads at these frames.

The bodies are the parts of the region that remain when the flexures are cut away. Each body is meshed with quadratic
triangles, and its stiffness and mass are condensed statically to its coordinate frames (Guyan, AIAA Journal 3 (1965)
380). A coordinate frame has the mean motion of a cut, weighted by a beam's stress so that it fits the adjoining beam,
or the motion of a face that is fixed, slides or is driven.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import bmat, csr_matrix
from scipy.sparse.linalg import splu

from fingervision.domain.errors import ModelError
from fingervision.models.mechanism_faces import keeps_from_turning, mean_weights
from fingervision.models.plane_stress import PlaneStressPlate

# Coordinate frames to which a meshed body is condensed: each frame has the motion of a cut or of a face.

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


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


def face_frame(
    plate: PlaneStressPlate, nodes: Indices, tied: Sequence[str], taken: set[int], weights: Array | None = None
) -> tuple[Frame, bool]:
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
    weights : ndarray of float, shape (k,), or None
        Weights of the nodes in the face's mean motion; None for those of a uniform load.

    Returns
    -------
    Frame, bool
        The frame, and whether the tied components keep the face from turning.
    """
    places = plate.nodes_mm[:, nodes]
    # A drive prescribes the face's mean motion, which is that of a rigid face at its weighted middle.
    at_mm = places.mean(axis=1) if weights is None else places @ weights / weights.sum()
    arms = places - at_mm[:, None]
    found: list[tuple[dict[int, float], list[float]]] = []
    dofs = {"x": plate.x_dofs[nodes], "y": plate.y_dofs[nodes]}
    levers = {"x": -arms[1], "y": arms[0]}
    for component in tied:
        for dof, lever in zip(dofs[component].tolist(), levers[component].tolist(), strict=True):
            if dof not in taken:
                taken.add(dof)
                found.append(({dof: 1.0}, [float(component == "x"), float(component == "y"), lever]))
    held = turns = keeps_from_turning(places, tied)
    weights = mean_weights(plate, nodes) if weights is None else weights
    for component in sorted({"x", "y"} - set(tied)):
        own, lever = dofs[component].tolist(), levers[component]
        mean = dict(zip(own, weights.tolist(), strict=True))
        found.append((mean, [float(component == "x"), float(component == "y"), float(weights @ lever)]))
        if not held and keeps_from_turning(places, (component,)):
            lever = lever - weights @ lever
            turn = dict(zip(own, (weights * lever / (weights @ lever**2)).tolist(), strict=True))
            found.append((turn, [0.0, 0.0, 1.0]))
            held = True
    rows = [(i, dof, value) for i, (row, _) in enumerate(found) for dof, value in row.items()]
    i, dof, value = zip(*rows, strict=True) if rows else ((), (), ())
    matrix = csr_matrix((value, (i, dof)), shape=(len(found), plate.unknowns))
    return Frame(at_mm, matrix, np.array([motion for _, motion in found]).reshape(-1, 3)), turns


_ITERATIONS = 8
"""Number of iterations of the search for modes. With 2 n + 2 iterated vectors, the first n modes have then converged to
1e-4, because each iteration reduces the error by a factor of at least (w_n / w_(2n+2))^4, where w_n is the n-th angular
frequency."""


@dataclass(frozen=True, slots=True, eq=False)
class CondensedBody:
    """One body, reduced to the displacements of its coordinate frames (static condensation).

    Parameters
    ----------
    frames : tuple of int
        Numbers of the body's frames; in large rotation the body's axes rotate with the first one.
    stiffness_n_mm, mass_t : ndarray of float, shape (3 m, 3 m)
        Stiffness and mass matrices for small motions of the body's frames.
    shapes_mm : ndarray of float, shape (unknowns of the plate, 3 m)
        Displacements of the body for unit motions of its frames.
    plate_unknowns : ndarray of int, shape (n,)
        Unknowns of the plate that belong to this body.
    solve_held : callable
        Maps loads on the body to its displacements with its frames held; each of shape (n, k).
    """

    frames: tuple[int, ...]
    stiffness_n_mm: Array
    mass_t: Array
    shapes_mm: Array
    plate_unknowns: Indices
    solve_held: Callable[[Array], Array]

    @property
    def unknowns(self) -> Indices:
        """Indices of the three motions (x, y, rotation) of each frame of this body among the motions of all bodies."""
        return np.asarray((3 * np.array(self.frames)[:, None] + np.arange(3)).ravel())


@dataclass(frozen=True, slots=True, eq=False)
class OwnModes:
    """Vibration modes of a body with its coordinate frames fixed, normalised by mass.

    Parameters
    ----------
    squared : ndarray of float, shape (k,)
        Angular frequencies squared, in 1/s^2.
    coupling_t : ndarray of float, shape (3 m, k)
        Mass that couples the modes with the motions of the frames.
    shapes_mm : ndarray of float, shape (unknowns of the plate, k)
        Displacements of the body in each mode.
    """

    squared: Array
    coupling_t: Array
    shapes_mm: Array


def condensed(
    plate: PlaneStressPlate, unknowns: Indices, frames: Sequence[Frame], places: Sequence[int]
) -> CondensedBody:
    """Condense one body to its coordinate frames.

    Parameters
    ----------
    plate : PlaneStressPlate
        The mesh of all bodies.
    unknowns : ndarray of int
        Unknowns of the plate that belong to this body.
    frames, places : sequence
        The body's frames, and their numbers among all frames.
    """
    K, M = (matrix[unknowns][:, unknowns] for matrix in (plate.stiffness_n_mm, plate.mass_t))
    scale = float(K.diagonal().mean())
    rows = bmat([[scale * frame.rows[:, unknowns]] for frame in frames], format="csr")
    motion = np.zeros((rows.shape[0], 3 * len(frames)))
    at = 0
    for place, frame in enumerate(frames):
        motion[at : at + len(frame.motion), 3 * place : 3 * place + 3] = scale * frame.motion
        at += len(frame.motion)
    whole = bmat([[K, rows.T], [rows, None]], format="csc")
    try:
        solver = splu(whole)
    except RuntimeError as error:
        x, y = np.round(frames[0].at_mm, 6) + 0.0
        raise ModelError(
            f"The body at ({x:.5g}, {y:.5g}) mm must have separate faces and flexures, but two of them share "
            "mesh nodes; check that no two faces or flexures overlap."
        ) from error
    given = np.vstack([np.zeros((unknowns.size, motion.shape[1])), motion])
    moved = solver.solve(given)[: unknowns.size]
    shapes = np.zeros((plate.unknowns, motion.shape[1]))
    shapes[unknowns] = moved
    stiffness = moved.T @ (K @ moved)
    mass = moved.T @ (M @ moved)

    def solve_held(loads: Array) -> Array:
        held = np.vstack([loads, np.zeros((rows.shape[0], loads.shape[1]))])
        return np.asarray(solver.solve(held)[: unknowns.size])

    return CondensedBody(
        tuple(places), 0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T), shapes, unknowns, solve_held
    )


def own_modes(plate: PlaneStressPlate, body: CondensedBody, count: int) -> OwnModes:
    """Compute the first modes of a body with fixed coordinate frames: at most a quarter as many modes as unknowns.

    Source: Bathe, Finite Element Procedures, section 11.6.
    """
    own = body.plate_unknowns
    K, M = (matrix[own][:, own] for matrix in (plate.stiffness_n_mm, plate.mass_t))
    count = min(count, int(np.count_nonzero(np.any(body.shapes_mm, axis=1))) // 4)
    if count == 0:
        return OwnModes(np.zeros(0), np.zeros((body.shapes_mm.shape[1], 0)), np.zeros((plate.unknowns, 0)))
    moved = np.random.default_rng(0).standard_normal((plate.unknowns, 2 * count + 2))[own]
    squared = np.ones(1)
    for _ in range(_ITERATIONS):
        moved = body.solve_held(M @ moved)
        squared, turned = eigh(moved.T @ (K @ moved), moved.T @ (M @ moved))
        moved = moved @ turned
    kept = moved[:, :count]
    shapes = np.zeros((plate.unknowns, count))
    shapes[own] = kept
    return OwnModes(squared[:count], body.shapes_mm[own].T @ (M @ kept), shapes)

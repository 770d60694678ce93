"""Elastic bodies condensed to coordinate frames: few unknowns per body, exact for static loads at these frames.

The bodies are the parts of the region that remain when the flexures are cut away. Each body is meshed with quadratic
triangles, and its stiffness and mass are condensed statically to its coordinate frames (Guyan, AIAA Journal 3 (1965)
380). A coordinate frame has the mean motion of a cut, weighted by a beam's stress so that it fits the adjoining beam,
or the motion of a face that is fixed, slides or is driven.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import bmat
from scipy.sparse.linalg import splu

from fingervision.domain.errors import ModelError
from fingervision.models.body_frames import Frame
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

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
        x, y = frames[0].at_mm
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

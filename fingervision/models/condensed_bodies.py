"""Elastic bodies condensed to the frames that join them: a few nodes each, exact for loads applied at the frames.

The bodies are the parts of the region that remain when the flexures are cut away. Each body is meshed with quadratic
triangles, and its stiffness and mass are condensed statically to its frames (Guyan, AIAA Journal 3 (1965) 380). A frame
is the mean motion of a cut, weighted by a beam's stress so that it fits the adjoining beam, or the nodes of a face that
is fixed, slides or is driven.
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
"""The first modes of 2 n + 2 vectors are then within 1e-4 of the limit: each step leaves (w_n / w_(2n+2))^4 at most."""


@dataclass(frozen=True, slots=True, eq=False)
class CondensedBody:
    """One body, reduced to the displacements of its frames (static condensation).

    Parameters
    ----------
    frames : tuple of int
        Places of its frames, the first the one that its axes turn with.
    stiffness_n_mm, mass_t : ndarray of float, shape (3 m, 3 m)
        Of small motions of its frames.
    shapes_mm : ndarray of float, shape (unknowns of the plate, 3 m)
        Displacements of the body by unit motions of its frames.
    solve_held : callable
        Loads on the plate to displacements of this body, its frames held; shape (unknowns of the plate, k) each.
    """

    frames: tuple[int, ...]
    stiffness_n_mm: Array
    mass_t: Array
    shapes_mm: Array
    solve_held: Callable[[Array], Array]

    @property
    def unknowns(self) -> Indices:
        """Indices of the three motions (x, y, rotation) of each of its frames among those of all frames."""
        return np.asarray((3 * np.array(self.frames)[:, None] + np.arange(3)).ravel())


@dataclass(frozen=True, slots=True, eq=False)
class OwnModes:
    """Vibration modes of a body with its frames fixed, normalised by mass.

    Parameters
    ----------
    squared : ndarray of float, shape (k,)
        Angular frequencies squared, in 1/s^2.
    coupling_t : ndarray of float, shape (3 m, k)
        Mass that couples them with the motions of the frames.
    """

    squared: Array
    coupling_t: Array


def condensed(
    plate: PlaneStressPlate, unknowns: Indices, frames: Sequence[Frame], places: Sequence[int]
) -> CondensedBody:
    """Condense one body to its frames.

    Parameters
    ----------
    plate : PlaneStressPlate
        All bodies.
    unknowns : ndarray of int
        Of this one.
    frames, places : sequence
        Its frames and their numbers.
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
        found = np.zeros_like(loads)
        held = np.vstack([loads[unknowns], np.zeros((rows.shape[0], loads.shape[1]))])
        found[unknowns] = solver.solve(held)[: unknowns.size]
        return found

    return CondensedBody(tuple(places), 0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T), shapes, solve_held)


def own_modes(plate: PlaneStressPlate, body: CondensedBody, count: int) -> OwnModes:
    """Compute the first modes of a body with fixed frames, by subspace iteration.

    Source: Bathe, Finite Element Procedures, section 11.6.
    """
    K, M = plate.stiffness_n_mm, plate.mass_t
    moved = np.random.default_rng(0).standard_normal((plate.unknowns, 2 * count + 2))
    squared = np.ones(1)
    for _ in range(_ITERATIONS):
        moved = body.solve_held(M @ moved)
        squared, turned = eigh(moved.T @ (K @ moved), moved.T @ (M @ moved))
        moved = moved @ turned
    kept = moved[:, :count]
    return OwnModes(squared[:count], body.shapes_mm.T @ (M @ kept))

"""Equilibrium in the deformed shape: Newton's method on the total Lagrangian equations, with contact where asked."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from fingervision.domain.errors import FingervisionError
from fingervision.models.half_body import ON_MM, Equilibrium, HalfBody

_NEWTON_STEPS = 15
_SET_CHANGES = 12
_RESIDUAL = 1e-8
_STEP_MM = 0.25


def large_equilibrium(half: HalfBody, input_mm: float, start: Equilibrium, *, contact: bool) -> Equilibrium:
    """Find the equilibrium at one input.

    With contact, nodes that would pass the symmetry plane are held on it, and nodes that it would have to pull are let
    go, until neither remains: gap >= 0, force >= 0, and one of them zero.

    Parameters
    ----------
    half : HalfBody
        The body.
    input_mm : float
        Displacement of the drive.
    start : Equilibrium
        A neighbouring equilibrium to begin from.
    contact : bool
        Whether the symmetry plane stops the fingers.

    Raises
    ------
    FingervisionError
        Where the iteration does not settle.
    """
    moved = start.displacement_mm + (input_mm - start.input_mm) * half.unit_displacement_mm
    touching = start.contact_n > 0.0
    for _ in range(_SET_CHANGES):
        moved, internal = _newton(half, input_mm, moved, touching)
        reaction = np.where(touching, internal[half.plate.x_dofs[half.face]], 0.0)
        wanted = (touching & (reaction > 0.0)) | (half.face_gap_mm(moved) < -ON_MM) & ~touching
        if not contact or np.array_equal(wanted, touching):
            return Equilibrium(input_mm, moved, 2.0 * float(internal[half.driven].sum()), reaction)
        touching = wanted
    raise FingervisionError(f"The touching part of the fingers did not settle at an input of {input_mm:g} mm.")


def _newton(
    half: HalfBody, input_mm: float, moved: NDArray[np.float64], touching: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    plate = half.plate
    held = plate.x_dofs[half.face[touching]]
    free = np.setdiff1d(half.free, held, assume_unique=True)
    scale_n = float(np.abs(plate.stiffness_n_mm @ half.unit_displacement_mm).max()) * max(abs(input_mm), 0.1)
    for _ in range(_NEWTON_STEPS):
        step = np.zeros_like(moved)
        step[half.driven] = input_mm - moved[half.driven]
        step[held] = -half.face_gap_mm(moved)[touching]
        tangent, internal = plate.internal_force_n(moved)
        if np.abs(internal[free]).max() < _RESIDUAL * scale_n and np.abs(step).max() < ON_MM:
            return moved, internal
        rhs = -(internal + tangent @ step)[free]
        step[free] = splu(tangent[free][:, free].tocsc()).solve(rhs)
        moved = moved + step
    raise FingervisionError(
        f"The large-rotation equilibrium at an input of {input_mm:g} mm was not found in {_NEWTON_STEPS} steps; "
        "use a smaller drive, or leave large rotation off."
    )


def large_path(half: HalfBody, last_mm: float, *, contact: bool) -> list[Equilibrium]:
    """Equilibria from rest to an input, in steps of about a quarter of a millimetre."""
    steps = max(2, int(np.ceil(abs(last_mm) / _STEP_MM)))
    path = [half.resting()]
    for step in range(1, steps + 1):
        path.append(large_equilibrium(half, last_mm * step / steps, path[-1], contact=contact))
    return path

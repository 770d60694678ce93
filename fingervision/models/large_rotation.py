"""Equilibrium in the deformed shape: Newton's method on the total Lagrangian equations, with contact if requested."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import ModelError
from fingervision.models.driven_body import DrivenBody, Equilibrium, factorised

_NEWTON_STEPS = 30
_SET_CHANGES = 12
_RESIDUAL = 1e-7
_ON_MM = 1e-7
_STEP_MM = 0.5
_SCALE_MM = 1e-3
_SLOW = 0.1
"""A residual that falls to less than a tenth in a step needs no new tangent, which costs as much as ten steps."""


def large_equilibrium(body: DrivenBody, input_mm: float, start: Equilibrium, *, contact: bool) -> Equilibrium:
    """Find the equilibrium at one input.

    With contact, nodes that would cross the symmetry plane are held on it, and nodes under tension are released, until
    no node changes: gap >= 0, force >= 0, and one of them zero.

    Parameters
    ----------
    body : DrivenBody
        The body.
    input_mm : float
        Displacement of the drive.
    start : Equilibrium
        A neighbouring equilibrium to begin from.
    contact : bool
        Whether the symmetry plane stops the fingers.

    Raises
    ------
    ModelError
        Where the iteration does not settle.
    """
    moved = start.displacement_mm + (input_mm - start.input_mm) * body.unit_displacement_mm
    touching = start.contact_n > 0.0
    for _ in range(_SET_CHANGES):
        moved, internal = _newton(body, input_mm, moved, touching)
        reaction = np.where(touching, internal[body.face], 0.0)
        wanted = (touching & (reaction > 0.0)) | (body.face_gap_mm(moved) < -_ON_MM) & ~touching
        if not contact or np.array_equal(wanted, touching):
            return Equilibrium(input_mm, moved, 2.0 * float(internal[body.driven].sum()), reaction)
        touching = wanted
    raise ModelError(f"The touching part of the fingers did not settle at an input of {input_mm:g} mm.")


def _newton(
    body: DrivenBody, input_mm: float, moved: NDArray[np.float64], touching: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    held = body.face[touching]
    free = np.setdiff1d(body.free, held, assume_unique=True)
    scale_n = float(np.abs(body.stiffness_n_mm @ body.unit_displacement_mm).max()) * max(abs(input_mm), _SCALE_MM)
    solver, before = None, np.inf
    for _ in range(_NEWTON_STEPS):
        step = np.zeros_like(moved)
        step[body.driven] = input_mm - moved[body.driven]
        step[held] = -body.face_gap_mm(moved)[touching]
        placed = np.abs(step).max() < _ON_MM
        internal = body.internal_force_n(moved)
        residual = float(np.abs(internal[free]).max())
        if residual < _RESIDUAL * scale_n and placed:
            return moved, internal
        if solver is None or not placed or residual > _SLOW * before:
            # A tangent serves as long as the residual falls well by it.
            tangent, internal = body.tangent(moved)
            solver = factorised(tangent[free][:, free])
            step[free] = solver.solve(-(internal + tangent @ step)[free])
        else:
            step[free] = solver.solve(-internal[free])
        moved, before = moved + step, residual
    raise ModelError(
        f"The large-rotation equilibrium at an input of {input_mm:g} mm was not found in {_NEWTON_STEPS} steps; "
        "use a smaller drive, or leave large rotation off."
    )


def large_path(
    body: DrivenBody, last_mm: float, *, start: Equilibrium | None = None, contact: bool = False, least: int = 3
) -> list[Equilibrium]:
    """Follow the equilibria from a first one, or from rest, to an input, in steps of at most half a millimetre.

    A curve needs at least three steps; one is enough where only the last equilibrium is needed (`least`).
    """
    path = [start or body.at_rest()]
    first_mm = path[0].input_mm
    key = (first_mm, last_mm, contact, least)
    if key in body.paths:
        return body.paths[key]
    steps = max(least, int(np.ceil(abs(last_mm - first_mm) / _STEP_MM)))
    for step in range(1, steps + 1):
        input_mm = last_mm if step == steps else first_mm + (last_mm - first_mm) * step / steps
        path.append(large_equilibrium(body, input_mm, path[-1], contact=contact))
    body.paths[key] = path
    return path


def first_touch(body: DrivenBody, guess_mm: float) -> Equilibrium:
    """Find the input at which the first point of the inner face meets the symmetry plane, by Newton's method."""
    if guess_mm in body.touches:
        return body.touches[guess_mm]
    state = large_equilibrium(body, guess_mm, body.at_rest(), contact=False)
    for _ in range(_SET_CHANGES):
        gaps_mm = body.face_gap_mm(state.displacement_mm)
        place = int(np.argmin(gaps_mm))
        if abs(gaps_mm[place]) < _ON_MM:
            body.touches[guess_mm] = state
            return state
        slope = float(body.unit_displacement_mm[body.face[place]])
        state = large_equilibrium(body, state.input_mm - float(gaps_mm[place]) / slope, state, contact=False)
    raise ModelError(f"The input at which the fingers first touch was not found near {guess_mm:g} mm.")

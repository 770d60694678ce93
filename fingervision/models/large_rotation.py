"""Equilibrium in the deformed shape: Newton's method on the total Lagrangian equations, with contact if requested.

One tangent matrix is used for many iterations, and for many inputs along the path, as long as the residual falls
quickly. If the fingers may touch, every step is a linear complementarity problem (Signorini) with the tangent's
compliance, so that touching and separating points are found together with the displacements (Newton's method for
generalised equations: Josephy, Mathematics Research Center report 1965, University of Wisconsin, 1979).
"""

from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import SuperLU

from fingervision.domain.errors import ModelError
from fingervision.models.driven_body import DrivenBody, Equilibrium, factorised
from fingervision.models.signorini import contact_forces_n

Array = NDArray[np.float64]

_TANGENTS, _STEPS_EACH = 30, 12
"""Largest number of tangent matrices, and of iterations with each matrix: computing a tangent costs as much as about
ten iterations."""
_SET_CHANGES = 12
_RESIDUAL, _ROUNDING = 1e-9, 1e-7
"""Largest residual of a solution, as a share of the largest nodal force at small displacements; and a larger residual
that is accepted as rounding error if further iterations do not reduce it."""
_ON_MM = 1e-7
_STEP_MM = 0.5
_SCALE_MM = 1e-3
_SMALLER = (1, 4, 16)
"""Numbers of smaller steps tried where a step does not converge."""
_CURVE = 3
"""Number of previous equilibria from which the next one is extrapolated."""


class _Tangent:
    """The latest tangent matrix of a body, factorised, with the displacements for a unit force on each face point."""

    def __init__(self, body: DrivenBody, *, contact: bool) -> None:
        self.body, self.contact = body, contact
        self._solver: SuperLU | None = None
        self.by_force = np.zeros((body.free.size, 0))
        self.compliance = np.zeros((0, 0))

    def renew(self, moved: Array) -> SuperLU:
        """Compute the tangent at given displacements."""
        free = self.body.free
        solver = factorised(self.body.tangent(moved)[0][free][:, free])
        self._solver = solver
        if self.contact:
            face = np.searchsorted(free, self.body.face)
            loads = np.zeros((free.size, face.size))
            loads[face, np.arange(face.size)] = 1.0
            self.by_force = np.asarray(solver.solve(loads))
            compliance = self.by_force[face]
            self.compliance = 0.5 * (compliance + compliance.T)
        return solver

    def step(self, moved: Array, internal_n: Array) -> tuple[Array, Array]:
        """Displacements of all unknowns, and contact forces, that balance the internal forces with this tangent."""
        body, step = self.body, np.zeros_like(moved)
        solver = self._solver or self.renew(moved)
        step[body.free] = solver.solve(-internal_n[body.free])
        pressed = np.zeros(body.face.size)
        if self.contact:
            try:
                pressed = contact_forces_n(self.compliance, body.face_gap_mm(moved) + step[body.face])
            except np.linalg.LinAlgError as error:  # far from an equilibrium a tangent need not be positive definite
                raise ModelError(
                    "Contact forces could not be computed: the deformed shape is not close to an equilibrium."
                ) from error
            step[body.free] += self.by_force @ pressed
        return step, pressed

    def ahead(self, last: Equilibrium, input_mm: float) -> tuple[Array, Array]:
        """Predict displacements and contact forces at an input from the tangent at the last equilibrium."""
        body, moved = self.body, last.displacement_mm
        self.renew(moved)
        given = np.zeros_like(moved)
        given[body.driven] = input_mm - last.input_mm
        step, pressed = self.step(moved + given, body.tangent(moved)[0] @ given + body.internal_force_n(moved))
        return moved + given + step, pressed


def large_equilibrium(
    body: DrivenBody,
    input_mm: float,
    start: Equilibrium,
    *,
    contact: bool,
) -> Equilibrium:
    """Find the equilibrium at one input.

    With contact, the gap and the contact force are both >= 0 at every point of the fingers' faces, and at least one of
    the two is zero.

    Parameters
    ----------
    body : DrivenBody
        The elastic half gripper.
    input_mm : float
        Displacement of the drive.
    start : Equilibrium
        A neighbouring equilibrium from which the iteration starts.
    contact : bool
        Whether the symmetry plane stops the fingers.

    Raises
    ------
    ModelError
        If the iteration does not converge.
    """
    return _next(_Tangent(body, contact=contact), input_mm, [start])


def _next(tangent: _Tangent, input_mm: float, path: list[Equilibrium]) -> Equilibrium:
    """Find the next equilibrium of a path."""
    body, last = tangent.body, path[-1]
    try:
        pressed = last.contact_n if tangent.contact else np.zeros(body.face.size)
        return _settled(tangent, input_mm, _predicted(body, input_mm, path), pressed)
    except ModelError:
        pass
    # The prediction was too far from the equilibria: follow the equilibria by their tangents, in smaller steps.
    for parts in _SMALLER[:-1]:
        try:
            return _followed(tangent, input_mm, last, parts)
        except ModelError:
            continue
    return _followed(tangent, input_mm, last, _SMALLER[-1])


def _followed(tangent: _Tangent, input_mm: float, last: Equilibrium, parts: int) -> Equilibrium:
    """Follow the equilibria from the last equilibrium to an input in equal steps, each predicted by the tangent."""
    state = last
    for at_mm in np.linspace(last.input_mm, input_mm, parts + 1)[1:].tolist():
        state = _settled(tangent, at_mm, *tangent.ahead(state, at_mm))
    return state


def _settled(tangent: _Tangent, input_mm: float, moved: Array, pressed: Array) -> Equilibrium:
    """Iterate from a prediction of displacements and contact forces to the equilibrium at an input."""
    body = tangent.body
    scale_n = float(np.abs(body.stiffness_n_mm @ body.unit_displacement_mm).max()) * max(abs(input_mm), _SCALE_MM)
    before, renewed, since, stepped = np.inf, 0, 0, False
    while True:
        internal = body.internal_force_n(moved)
        unbalanced = internal.copy()
        unbalanced[body.face] -= pressed
        residual = float(np.abs(unbalanced[body.free]).max())
        # After a step, complementarity holds exactly, because gaps are linear in the displacements.
        settled = residual < _RESIDUAL * scale_n or (residual < _ROUNDING * scale_n and 2.0 * residual > before)
        if settled and (stepped or not tangent.contact):
            return Equilibrium(input_mm, moved, 2.0 * float(internal[body.driven].sum()), pressed)
        if _is_slow(body, residual, before, _RESIDUAL * scale_n, since):
            if renewed == _TANGENTS or not np.isfinite(residual):
                raise ModelError(
                    f"The large-rotation equilibrium at an input of {input_mm:g} mm was not found in {_TANGENTS} "
                    "steps; use a smaller input, or leave large rotation off."
                )
            tangent.renew(moved)
            renewed, since = renewed + 1, 0
        step, pressed = tangent.step(moved, internal)
        moved, before, since, stepped = moved + step, residual, since + 1, True


def _is_slow(body: DrivenBody, residual: float, before: float, wanted: float, since: int) -> bool:
    """Whether computing a new tangent takes less work than the further steps with the present one."""
    if body.nodal_force is None:  # computing the forces also computes the tangent
        return True
    if not residual < before:
        return bool(np.isfinite(before))
    if not np.isfinite(before):
        return False
    return since >= _STEPS_EACH or log(wanted / residual) / log(residual / before) > _STEPS_EACH - since


def _predicted(body: DrivenBody, input_mm: float, path: list[Equilibrium]) -> Array:
    """Extrapolate the path of equilibria; if only one equilibrium is known, add small displacements to it."""
    last = path[-1]
    if len(path) == 1:
        return last.displacement_mm + (input_mm - last.input_mm) * body.unit_displacement_mm
    known = path[-_CURVE:]
    moved = np.zeros_like(last.displacement_mm)
    for state in known:
        others = [other.input_mm for other in known if other is not state]
        moved += np.prod([(input_mm - at) / (state.input_mm - at) for at in others]) * state.displacement_mm
    return moved


def large_path(
    body: DrivenBody, last_mm: float, *, start: Equilibrium | None = None, contact: bool = False, least: int = 3
) -> list[Equilibrium]:
    """Follow the equilibria from a given equilibrium, or from rest, to an input, in steps of at most 0.5 mm.

    `least` is the least number of steps: three for a curve through the equilibria, one if only the last equilibrium is
    needed.
    """
    path = [start or body.at_rest()]
    first_mm = path[0].input_mm
    key = (first_mm, last_mm, contact, least)
    if key in body.paths:
        return body.paths[key]
    steps = max(least, int(np.ceil(abs(last_mm - first_mm) / _STEP_MM)))
    tangent = _Tangent(body, contact=contact)
    for step in range(1, steps + 1):
        input_mm = last_mm if step == steps else first_mm + (last_mm - first_mm) * step / steps
        path.append(_next(tangent, input_mm, path))
    body.paths[key] = path
    return path


def first_touch(body: DrivenBody, guess_mm: float) -> Equilibrium:
    """Find the input at which the first point of the inner face meets the symmetry plane, by Newton's method."""
    if guess_mm in body.touches:
        return body.touches[guess_mm]
    tangent = _Tangent(body, contact=False)
    state = _next(tangent, guess_mm, [body.at_rest()])
    for _ in range(_SET_CHANGES):
        gaps_mm = body.face_gap_mm(state.displacement_mm)
        place = int(np.argmin(gaps_mm))
        if abs(gaps_mm[place]) < _ON_MM:
            body.touches[guess_mm] = state
            return state
        slope = float(body.unit_displacement_mm[body.face[place]])
        state = _next(tangent, state.input_mm - float(gaps_mm[place]) / slope, [state])
    raise ModelError(f"The input at which the fingers first touch was not found near {guess_mm:g} mm.")

"""Static response of a driven body to a list of inputs: small or large displacements, with or without contact."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fingervision.domain.gripper import PointMm
from fingervision.domain.response import Response
from fingervision.models.answer_figures import LoadedState
from fingervision.models.driven_body import DrivenBody, Equilibrium
from fingervision.models.large_rotation import first_touch, large_path
from fingervision.models.physics import Physics

Array = NDArray[np.float64]

_LEAST_MM = 1e-3
_NEAR_TOUCH = 0.9
_SAMPLES_BEYOND_TOUCH = 200


def symmetric_response(body: DrivenBody, physics: Physics, input_mm: Array) -> Response:
    """Compute the static response at each input, for two identical halves.

    Parameters
    ----------
    body : DrivenBody
        The right half.
    physics : Physics
        Which effects beyond small displacements are included.
    input_mm : ndarray of float, shape (n,)
        Inputs.
    """
    right, force = _right_and_force(body, physics, np.asarray(input_mm, dtype=float))
    return Response(left_mm=-right, right_mm=right, force_n=force)


def gap_per_input(body: DrivenBody) -> float:
    """Ratio of gap to input (mm per mm), at zero input."""
    return 2.0 * (body.measured_mm(body.unit_displacement_mm) - body.measured_rest_mm)


def equilibria(body: DrivenBody, physics: Physics, inputs_mm: Sequence[float]) -> list[Equilibrium]:
    """Equilibria at the given inputs, in order, with the requested physics."""
    if not physics.large_rotation:
        return [body.equilibrium(value, contact=physics.contact) for value in inputs_mm]
    touch_mm = body.first_touch_mm() if physics.contact else None
    found: dict[float, Equilibrium] = {0.0: body.at_rest()}
    for sign in (-1.0, 1.0):
        state = body.at_rest()
        for value in sorted((v for v in inputs_mm if v * sign > 0.0), key=abs):
            contact = touch_mm is not None and value < _NEAR_TOUCH * touch_mm
            if contact and state.input_mm > (touch_mm or 0.0):
                first = first_touch(body, touch_mm or 0.0)
                state = first if value < first.input_mm else state
            state = large_path(body, value, start=state, contact=contact, least=1)[-1]
            found[value] = state
    return [found[value] for value in inputs_mm]


def contact_onset_mm(body: DrivenBody, physics: Physics) -> float | None:
    """Input at which the fingers first touch (mm), in the deformed shape if requested; None if they never touch."""
    touch_mm = body.first_touch_mm()
    if touch_mm is None or not physics.large_rotation:
        return touch_mm
    return first_touch(body, touch_mm).input_mm


def loaded_state(body: DrivenBody, state: Equilibrium, stress_mpa: float, place_mm: PointMm) -> LoadedState:
    """Collect gap, forces and stress of one equilibrium."""
    gap_mm = 2.0 * body.measured_mm(state.displacement_mm)
    return LoadedState(state.input_mm, gap_mm, state.force_n, float(state.contact_n.sum()), stress_mpa, place_mm)


def _right_and_force(body: DrivenBody, physics: Physics, inputs: Array) -> tuple[Array, Array]:
    touch_mm = body.first_touch_mm() if physics.contact else None
    if physics.large_rotation:
        return _large(body, inputs, touch_mm)
    right = body.measured_rest_mm + 0.5 * gap_per_input(body) * inputs
    force = body.equilibrium(1.0).force_n * inputs
    if touch_mm is not None and np.any(inputs < touch_mm):
        # Linear complementarity: the response is piecewise linear, with a kink where another point touches.
        at = np.linspace(float(inputs.min()), touch_mm, _SAMPLES_BEYOND_TOUCH)
        _, pressed, pull = _curve(body, [body.equilibrium(value, contact=True) for value in at.tolist()])
        beyond = inputs < touch_mm
        right[beyond] = np.interp(inputs[beyond], at, pressed)
        force[beyond] = np.interp(inputs[beyond], at, pull)
    return right, force


def _large(body: DrivenBody, inputs: Array, touch_mm: float | None) -> tuple[Array, Array]:
    """Gap and force over the inputs, from a cubic spline through equilibria along the path from rest."""
    lowest = min(float(inputs.min(initial=0.0)), -_LEAST_MM)
    highest = max(float(inputs.max(initial=0.0)), _LEAST_MM)
    touching: list[Equilibrium] = []
    if touch_mm is not None and lowest < _NEAR_TOUCH * touch_mm:
        first = first_touch(body, touch_mm)
        if lowest < first.input_mm:
            touching = large_path(body, lowest, start=first, contact=True)[1:]
            lowest = first.input_mm
    free = large_path(body, lowest)[:0:-1] + large_path(body, highest)
    at, right, force = _curve(body, free)
    answer = CubicSpline(at, right)(inputs), CubicSpline(at, force)(inputs)
    if touching:
        # The curve has a kink where the tip first touches; beyond first touch, the curve is straight within 1 in 1000.
        beyond = inputs < at[0]
        pressed = _curve(body, [*touching[::-1], free[0]])
        for smooth, curve in zip(answer, pressed[1:], strict=True):
            smooth[beyond] = np.interp(inputs[beyond], pressed[0], curve)
    return answer


def _curve(body: DrivenBody, states: list[Equilibrium]) -> tuple[Array, Array, Array]:
    return (
        np.array([state.input_mm for state in states]),
        np.array([body.measured_mm(state.displacement_mm) for state in states]),
        np.array([state.force_n for state in states]),
    )

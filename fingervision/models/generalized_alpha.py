"""Time integration of a body in large rotation and contact: the generalised-alpha method.

Second order in the step, with a chosen damping of frequencies that the step cannot resolve. Source: Chung and Hulbert,
J. Appl. Mech. 60 (1993) 371.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from fingervision.domain.errors import FingervisionError

Array = NDArray[np.float64]

_ITERATIONS = 25
_SETTLED = 1e-8


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Displacements, velocities and accelerations, one row a time."""

    displacement: Array
    velocity: Array
    acceleration: Array


def integrate(
    mass: csr_matrix,
    damping: csr_matrix,
    internal: Callable[[Array], tuple[csr_matrix, Array]],
    start: tuple[Array, Array],
    prescribed: tuple[NDArray[np.int64], Array],
    free: NDArray[np.int64],
    step_s: float,
    *,
    high_frequency_radius: float = 0.8,
) -> Motion:
    """Follow M a + C v + f(u) = 0 over equal steps.

    Parameters
    ----------
    mass, damping : sparse matrix, shape (n, n)
        Of all unknowns.
    internal : callable
        Displacements to tangent stiffness and internal forces.
    start : (ndarray, ndarray)
        Displacements and velocities at the first time.
    prescribed : (ndarray of int, ndarray, shape (steps + 1,))
        Unknowns that all follow one history, and the history.
    free : ndarray of int
        Unknowns that move; those neither free nor prescribed are held.
    step_s : float
        Time step.
    high_frequency_radius : float
        Spectral radius at infinite frequency: 1 keeps all energy, 0 annihilates what the step cannot resolve.

    Raises
    ------
    FingervisionError
        Where a step does not settle.
    """
    rho = high_frequency_radius
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (1.0 - alpha_m + alpha_f) ** 2
    driven, history = prescribed
    driven_speed = np.gradient(history, step_s) if history.size > 1 else np.zeros_like(history)
    driven_acceleration = np.gradient(driven_speed, step_s) if history.size > 1 else np.zeros_like(history)
    u, v = start[0].copy(), start[1].copy()
    a = np.zeros_like(u)
    _, force = internal(u)
    a[free] = _solve(mass, free, -(force + damping @ v)[free])
    rows: list[tuple[Array, Array, Array]] = [(u, v, a)]
    for place in range(1, history.size):
        u0, v0, a0 = u, v, a
        a = a0.copy()
        u = u0 + step_s * v0 + step_s**2 * ((0.5 - beta) * a0 + beta * a)
        v = v0 + step_s * ((1.0 - gamma) * a0 + gamma * a)
        u[driven], v[driven], a[driven] = history[place], driven_speed[place], driven_acceleration[place]
        scale = 0.0
        for _ in range(_ITERATIONS):
            tangent, force = internal((1.0 - alpha_f) * u + alpha_f * u0)
            inertia = mass @ ((1.0 - alpha_m) * a + alpha_m * a0)
            drag = damping @ ((1.0 - alpha_f) * v + alpha_f * v0)
            residual = (inertia + drag + force)[free]
            scale = max(scale, float(np.abs(inertia).max() + np.abs(drag).max() + np.abs(force).max()))
            if np.abs(residual).max() <= _SETTLED * scale or scale == 0.0:
                break
            effective = (
                (1.0 - alpha_m) / (beta * step_s**2) * mass
                + (1.0 - alpha_f) * gamma / (beta * step_s) * damping
                + (1.0 - alpha_f) * tangent
            )
            change = -_solve(csr_matrix(effective), free, residual)
            u[free] += change
            v[free] += gamma / (beta * step_s) * change
            a[free] += change / (beta * step_s**2)
        else:
            raise FingervisionError(f"The motion did not settle in step {place} of {step_s:g} s; use shorter steps.")
        rows.append((u.copy(), v.copy(), a.copy()))
    return Motion(*(np.array(part) for part in zip(*rows, strict=True)))


def _solve(matrix: csr_matrix, free: NDArray[np.int64], right: Array) -> Array:
    part = matrix[free][:, free].tocsc()
    if not np.all(part.diagonal()):
        # Massless unknowns have no acceleration of their own at the start.
        live = part.diagonal() != 0.0
        answer = np.zeros_like(right)
        answer[live] = right[live] / part.diagonal()[live]
        return answer
    return np.asarray(splu(part).solve(right))

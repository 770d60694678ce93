"""Time integration of a body in large rotation and contact: the generalised-alpha method.

The method is second-order accurate in the time step, with adjustable damping of frequencies that the step does not
resolve. Source: Chung and Hulbert, 1993, Journal of Applied Mechanics 60, 371.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from fingervision.domain.errors import ModelError

Array = NDArray[np.float64]

_ITERATIONS = 25
_SETTLED = 1e-8
_SLOW = 0.1
"""Ratio of two successive residuals below which the factorisation of the previous iteration is kept."""
_DENSE_BELOW = 400


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Displacements, velocities and accelerations, one row per time."""

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
    """Integrate M a + C v + f(u) = 0 over equal time steps, for displacement u, velocity v and acceleration a.

    Parameters
    ----------
    mass, damping : sparse matrix, shape (n, n)
        Mass and damping matrices for all unknowns.
    internal : callable
        Maps displacements to the tangent stiffness and the internal forces.
    start : (ndarray, ndarray)
        Displacements and velocities at the first time.
    prescribed : (ndarray of int, ndarray, shape (steps + 1,))
        Indices of the unknowns that all follow one prescribed history, and this history, linear within each step. The
        masses of these unknowns must not be coupled to those of the free unknowns: the impulses at the kinks of the
        history would be lost.
    free : ndarray of int
        Indices of the unknowns that are free to move; those neither free nor prescribed are fixed.
    step_s : float
        Time step.
    high_frequency_radius : float
        Spectral radius at infinite frequency: 1 conserves all energy, 0 annihilates frequencies too high for the step.

    Raises
    ------
    ModelError
        If the iteration of a step does not converge.
    """
    rho = high_frequency_radius
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (1.0 - alpha_m + alpha_f) ** 2
    driven, history = prescribed
    speed = np.diff(history, prepend=history[:1]) / step_s
    u, v = start[0].copy(), start[1].copy()
    a = np.zeros_like(u)
    _, force = internal(u)
    a[free] = _at_first(mass, free, -(force + damping @ v)[free])
    rows: list[tuple[Array, Array, Array]] = [(u, v, a)]
    solver: _Factor | None = None
    for place in range(1, history.size):
        u0, v0, a0 = u, v, a
        a = a0.copy()
        u = u0 + step_s * v0 + step_s**2 * ((0.5 - beta) * a0 + beta * a)
        v = v0 + step_s * ((1.0 - gamma) * a0 + gamma * a)
        u[driven], v[driven], a[driven] = history[place], speed[place], 0.0
        scale, before = 0.0, np.inf
        for _ in range(_ITERATIONS):
            tangent, force = internal((1.0 - alpha_f) * u + alpha_f * u0)
            inertia = mass @ ((1.0 - alpha_m) * a + alpha_m * a0)
            drag = damping @ ((1.0 - alpha_f) * v + alpha_f * v0)
            residual = (inertia + drag + force)[free]
            scale = max(scale, float(np.abs(inertia).max() + np.abs(drag).max() + np.abs(force).max()))
            left = float(np.abs(residual).max())
            if left <= _SETTLED * scale or scale == 0.0:
                break
            if solver is None or left > _SLOW * before:
                # Use one factorisation for as long as the residual falls quickly.
                effective = (
                    (1.0 - alpha_m) / (beta * step_s**2) * mass
                    + (1.0 - alpha_f) * gamma / (beta * step_s) * damping
                    + (1.0 - alpha_f) * tangent
                )
                solver = _Factor(csr_matrix(effective), free)
            change, before = -solver.solve(residual), left
            u[free] += change
            v[free] += gamma / (beta * step_s) * change
            a[free] += change / (beta * step_s**2)
        else:
            raise ModelError(f"The motion did not converge in step {place} of {step_s:g} s; use shorter steps.")
        rows.append((u.copy(), v.copy(), a.copy()))
    return Motion(*(np.array(part) for part in zip(*rows, strict=True)))


class _Factor:
    """Factorisation of the free part of a matrix; small matrices are treated as dense, which is three times as fast."""

    def __init__(self, matrix: csr_matrix, free: NDArray[np.int64]) -> None:
        part = matrix[free][:, free]
        if free.size < _DENSE_BELOW:
            self._dense: Any = lu_factor(part.toarray(), check_finite=False)
        else:
            self._dense, self._sparse = None, splu(part.tocsc())

    def solve(self, right: Array) -> Array:
        """Solve for the free unknowns."""
        if self._dense is not None:
            return np.asarray(lu_solve(self._dense, right, check_finite=False))
        return np.asarray(self._sparse.solve(right))


def _at_first(mass: csr_matrix, free: NDArray[np.int64], right: Array) -> Array:
    """Accelerations at the start of the motion; zero for unknowns without mass."""
    part = mass[free][:, free].tocsc()
    if np.all(part.diagonal()):
        return np.asarray(splu(part).solve(right))
    live = part.diagonal() != 0.0
    answer = np.zeros_like(right)
    answer[live] = right[live] / part.diagonal()[live]
    return answer

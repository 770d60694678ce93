"""Frictionless contact with a rigid plane (Signorini's problem), reduced to the points that may touch."""

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

Array = NDArray[np.float64]


def contact_forces_n(compliance_mm_n: Array, free_gap_mm: Array) -> Array:
    """Find the forces that keep every point on its side of the plane.

    With the compliance matrix C, the equation gap = free_gap + C force is solved for gap >= 0, force >= 0, gap * force
    = 0. The forces f minimise f' C f / 2 + g' f over f >= 0, with the free gap g. This quadratic programme is solved as
    a non-negative least-squares problem, by the factorisation C = L L'.

    Parameters
    ----------
    compliance_mm_n : ndarray of float, shape (n, n)
        Displacement away from the plane at point i by a unit force at point j; symmetric and positive definite.
    free_gap_mm : ndarray of float, shape (n,)
        Distance from the plane without contact; negative where a point would pass through.

    Returns
    -------
    ndarray of float, shape (n,)
        Contact forces.
    """
    if np.all(free_gap_mm >= 0.0):
        return np.zeros_like(free_gap_mm)
    factor = np.linalg.cholesky(compliance_mm_n)
    target = scipy.linalg.solve_triangular(factor, -free_gap_mm, lower=True)
    forces, _ = scipy.optimize.nnls(factor.T, target)
    return np.asarray(forces)

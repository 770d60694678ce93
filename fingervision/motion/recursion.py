"""Recursion of first order, y[i] = x[i] + a y[i - 1]: exponential means, and noise with a memory."""

import numpy as np
from scipy.linalg.blas import dtbsv

from fingervision.domain.effect import Array


def recursion(feedback: float, values: Array) -> Array:
    """Solve y[i] = x[i] + a y[i - 1] with y[-1] = 0.

    It is the triangular system of two diagonals, which BLAS solves; `scipy.signal`, which has a filter for it, takes
    half a second to import.

    Parameters
    ----------
    feedback : float
        The factor a.
    values : ndarray of float, shape (n,)
        The input x.

    Returns
    -------
    ndarray of float, shape (n,)
        The output y.
    """
    diagonals = np.full((2, values.size), -feedback, order="F")
    return np.asarray(dtbsv(1, diagonals, values, lower=1, diag=1), dtype=np.float64)

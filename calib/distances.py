"""Distances in millimetres, with their uncertainty."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Distances:
    """Distances between pairs of points of a flat scene.

    Parameters
    ----------
    value_mm : ndarray of float, shape (n,)
        The distances.
    u_mm : ndarray of float, shape (n,), or None
        Standard uncertainties that include the scale's whole budget; None if the scale has no stated uncertainty.
    u_random_mm : ndarray of float, shape (n,)
        Random standard uncertainties, due to effects that vary from frame to frame.
    """

    value_mm: NDArray[np.float64]
    u_mm: NDArray[np.float64] | None
    u_random_mm: NDArray[np.float64]

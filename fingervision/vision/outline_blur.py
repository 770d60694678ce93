"""Bias of an edge fitted along a slanted line on a curved, blurred outline."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# The constant 1 / (2 sqrt pi).
ROOT = 0.5 / float(np.sqrt(np.pi))


def curvature_gain(slope: Floats, reach_sigmas: Floats) -> Floats:
    """Bias of an edge fitted along a slanted line on a curved outline, relative to the bias of the half-level.

    Along a line that meets a curved edge at a slant of slope m, the distance to the edge is t + kappa m^2 t^2 / (2 (1 +
    m^2)^(1/2)). Projected on the parameters of the fit over a window of w standard deviations, the quadratic term moves
    the position by m^2 c sigma^2 kappa / 2 across the edge, c = (1 / (4 sqrt pi) - 1 / 2w) / (1 / (2 sqrt pi) - 1 /
    2w); the half-level itself is moved by sigma^2 kappa / 2.
    """
    level = 0.5 / np.maximum(reach_sigmas, 2.5)
    return np.asarray(1.0 + slope**2 * (0.5 * ROOT - level) / (ROOT - level))

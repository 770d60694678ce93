"""What a picture makes of a point x (mm from the centre): cameras whose forms are not quite the catalogue's."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def nearer(x_mm: Array, opened_mm: Array, relative_per_mm: float) -> Array:
    """Tips that leave the plane: the distance shrinks with a small square term."""
    way = relative_per_mm * opened_mm
    return x_mm / (1 - way - 0.2 * way * np.abs(way))


def lens(x_mm: Array, k_per_mm2: float) -> Array:
    """Radial distortion with a k2 term, 6 % of the first where the points are farthest out."""
    far_mm = max(float(np.max(np.abs(x_mm))), 1e-3)
    return x_mm * (1 + k_per_mm2 * x_mm**2 * (1 + 0.06 * (x_mm / far_mm) ** 2))


def tilted(x_mm: Array, k_per_mm: float) -> Array:
    """A tilted plane through a pinhole."""
    return x_mm / (1 + k_per_mm * x_mm)

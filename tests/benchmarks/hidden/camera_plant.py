"""Camera effects on a point at x (mm from the centre), with formulas that differ slightly from the catalogue's."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def nearer(x_mm: Array, opened_mm: Array, relative_per_mm: float) -> Array:
    """Out-of-plane motion of the tips: the distance to the camera decreases, with a small quadratic term."""
    way = relative_per_mm * opened_mm
    return x_mm / (1 - way - 0.2 * way * np.abs(way))


def lens(x_mm: Array, k_per_mm2: float) -> Array:
    """Radial distortion with a k2 term, which is 6 % of the first term at the outermost points."""
    far_mm = max(float(np.max(np.abs(x_mm))), 1e-3)
    return x_mm * (1 + k_per_mm2 * x_mm**2 * (1 + 0.06 * (x_mm / far_mm) ** 2))


def tilted(x_mm: Array, k_per_mm: float) -> Array:
    """Tilted plane, projected by a pinhole camera."""
    return x_mm / (1 + k_per_mm * x_mm)

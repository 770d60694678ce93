"""Distance between a blurred corner's half-level contour and the vertex of the corner."""

from functools import lru_cache
from math import cos, erf, exp, pi, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Number of midpoints in the integral over the corner's half angle; the error is 1e-4 sigma for turns up to 150 degrees.
MIDPOINTS = 48
# Number of halvings of the interval that contains the half-level.
HALVINGS = 30
# Step of the turn (radians) for which results are stored; the error is below 1e-3 sigma.
STEP = 0.005
# Coefficient c of the model exp(-c s^2) for the decrease of the blur's effect along the sides, where s is the distance
# from the vertex in sigma. The value is fitted to the exact half-level of a right-angled corner, Phi(a) Phi(s) = 1/2
# with the depth a, between s = 0.5 and 2.
FALL = 0.4


def corner_half_level(beside: Floats, radius: Floats, turn: float, blur: float) -> Floats:
    """Distance of a rounded, blurred corner's half-level contour from the vertex, at points beside the bisector.

    The effects of fillet and blur are added in quadrature, which is exact for a sharp corner and at the middle of a
    fillet.

    Parameters
    ----------
    beside : ndarray of float
        Distance from the bisector (pixels).
    radius : ndarray of float
        Radius of the fillet (pixels), of a shape that broadcasts with `beside`.
    turn : float
        Change of the outline's direction at the corner (radians).
    blur : float
        Gaussian sigma of the optics (pixels).
    """
    half = 0.5 * turn
    on_arc = np.sqrt(np.maximum(radius**2 - beside**2, 0.0))
    arc = np.where(np.abs(beside) < radius * sin(half), radius / cos(half) - on_arc, np.abs(beside) * tan(half))
    along = beside / (blur * cos(half))
    return np.asarray(np.sqrt(arc**2 + (corner_retreat(turn) * blur) ** 2 * np.exp(-FALL * along**2)))


def corner_retreat(turn: float) -> float:
    """Distance of the half-level from the vertex of a blurred sharp corner, along its bisector, in units of sigma.

    At a depth a (in sigma) inside both sides of a wedge whose sides turn by theta, the blurred coverage is Phi(a) - 2
    T(a, tan(theta / 2)), with T Owen's function (Ann. Math. Stat. 27, 1956, doi:10.1214/aoms/1177728074); the
    half-level is where the coverage equals one half.

    Parameters
    ----------
    turn : float
        Change of the outline's direction at the corner (radians); 0 for a straight outline.
    """
    return _retreat(round(turn / STEP))


@lru_cache(maxsize=1024)
def _retreat(steps: int) -> float:
    turn = steps * STEP
    low, high = 0.0, 6.0
    for _halving in range(HALVINGS):
        depth = 0.5 * (low + high)
        low, high = (depth, high) if _share(depth, turn) < 0.5 else (low, depth)
    return 0.5 * (low + high) / cos(0.5 * turn)


def _share(depth: float, turn: float) -> float:
    """Blurred coverage of a wedge at a point with the same depth inside both of its sides."""
    width = 0.5 * turn / MIDPOINTS
    owen = sum(exp(-0.5 * (depth / cos((k + 0.5) * width)) ** 2) for k in range(MIDPOINTS)) * width / (2.0 * pi)
    return 0.5 * (1.0 + erf(depth / sqrt(2.0))) - 2.0 * owen

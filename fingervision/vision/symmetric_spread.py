"""Fit of an edge with any symmetric blur, to find the part of a mean profile that no symmetric blur explains.

Defocus, motion or a halo blurs a step of light into a profile that is antisymmetric (odd) about the edge, whatever the
shape of the blur. Glare and shadow have profiles with a symmetric (even) part.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Floats = NDArray[np.float64]

# Steps of the free antisymmetric part: half a blur, at least half a pixel (the width of a bin), and their number on
# either side, up to five blurs.
STEP_IN_BLURS, LEAST_STEP_PX, STEPS = 0.5, 0.5, 10
# Number of Gauss-Newton steps for the position of the edge, starting from the half-level.
LOOKS = 4
# Largest distance of the edge from the fitted single step (pixels).
FARTHEST_PX = 1.0


def symmetric_squares(t: Floats, value: Floats, weight: Floats, blur: float) -> float:
    """Weighted sum of squared residuals of a step with symmetric blur of free shape.

    Parameters
    ----------
    t : ndarray of float, shape (n,)
        Positions, outwards from the fitted single step (pixels).
    value, weight : ndarray of float, shape (n,)
        Light at these positions, and the inverse of its variance.
    blur : float
        Blur of the fitted single step (pixels).
    """
    knots = np.arange(1, STEPS + 1) * max(STEP_IN_BLURS * blur, LEAST_STEP_PX)
    root, place, least = np.sqrt(weight), 0.0, np.inf
    for look in range(LOOKS):
        away = t - place
        hats = np.maximum(1.0 - np.abs(np.abs(away)[:, None] - knots) / knots[0], 0.0) * np.sign(away)[:, None]
        step = ndtr(away / blur)
        slope = np.exp(-0.5 * (away / blur) ** 2)
        columns = np.column_stack((np.ones_like(t), step, hats))
        own, *_ = np.linalg.lstsq(root[:, None] * columns, root * value, rcond=None)
        least = min(least, float(np.sum((root * (value - columns @ own)) ** 2)))
        if look == LOOKS - 1:
            break
        both = np.column_stack((columns, slope))
        found, *_ = np.linalg.lstsq(root[:, None] * both, root * value, rcond=None)
        contrast = own[1] if abs(own[1]) > 0.0 else 1.0
        place -= float(np.clip(found[-1] * blur * np.sqrt(2.0 * np.pi) / contrast, -0.5, 0.5))
        if abs(place) > FARTHEST_PX:
            break
    return least

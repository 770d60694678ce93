"""Models of the mean profile across a flank, each fitted by least squares.

A finger's edge is a step of light, blurred by the optics. Beside the edge there may be a second step (the side wall of
a thick part, between the finger's face and the background), a ramp (a soft shadow on the background) or a bright line
(glare along the edge, on the finger). Each of these structures displaces a fitted single step towards itself.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]

# What the profile is made of beside the step.
# A shadow falls off along a straight line (SHADOW) or as an exponential (FADING): real penumbras lie between the two.
STEP, WALL, SHADOW, GLARE, FADING = range(5)
# Where the search for the breadth of each begins (pixels), and the limits within which it stays.
STARTS_PX = ((0.0,), (1.5, 3.0, 5.0), (4.0, 8.0, 14.0), (1.0, 2.5, 4.5), (2.0, 4.0, 8.0))
LIMITS_PX = ((0.0, 0.0), (0.8, 10.0), (2.0, 24.0), (0.5, 8.0), (1.0, 16.0))
# Sharpening, and the tails of real optics, add an odd part: a step of this many times the blur less the step itself.
TAIL_BLURS = 2.2
# Blur of the optics, the pixel included, stays within these limits (pixels).
LEAST_BLUR_PX, LARGEST_BLUR_PX = 0.3, 5.0
# The edge is looked for so far from where the single step was found (pixels).
FARTHEST_PX = 7.0
# Level, contrast, tail, addition; position, blur and breadth.
LINEAR, PARAMETERS = 4, 7
POSITION, BLUR, BREADTH = 4, 5, 6
ITERATIONS, SETTLED = 40, 1e-7
# A fit that leaves too many squares to be chosen goes on only while every step takes this share of them away.
SLOW = 0.01
# Blur as the picture's other edges tell it (standard uncertainty, relative).
U_BLUR = 0.1

_addition = loop("profile_models_addition")
_fit_profile = loop("profile_models_fit_profile")


class ProfileFit(NamedTuple):
    """Fit of one model to a mean profile.

    Parameters
    ----------
    squares : float
        Weighted sum of the squared residuals.
    position : float
        Position of the finger's edge, measured outwards from the fitted single step (pixels).
    u_position : float
        Standard uncertainty of the position, if the weighted residuals have unit variance.
    breadth : float
        Breadth of the wall or shadow, or distance of the glare inside the edge (pixels).
    share : float
        Strength of the added structure, as a share of the contrast between finger and background.
    blur : float
        Standard deviation of the blur, the pixel's width included (pixels).
    """

    squares: float
    position: float
    u_position: float
    breadth: float
    share: float
    blur: float


def addition(kind: int, t: float, blur: float, breadth: float) -> float:
    """Blurred structure beside the step, as a function of the distance outwards from the edge."""
    return float(_addition(kind, t, blur, breadth))


def fit_profile(
    kind: int,
    t: Floats,
    value: Floats,
    weight: Floats,
    blur: float,
    start: float,
    is_blur_known: bool = False,
    too_many: float = np.inf,
) -> ProfileFit:
    """Fit one model to a mean profile (Levenberg and Marquardt over position, blur and breadth).

    Parameters
    ----------
    kind : int
        STEP, WALL, SHADOW, GLARE or FADING.
    t : ndarray of float, shape (n,)
        Positions, outwards from the fitted single step (pixels).
    value, weight : ndarray of float, shape (n,)
        Light at these positions, and the inverse of its variance.
    blur, start : float
        Initial estimates of the blur and of the breadth (pixels).
    is_blur_known : bool
        Whether the blur is fixed to the given value.
    too_many : float
        Sum of squares above which the fit is stopped early, because the model will not be chosen.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the parts of the model are indistinguishable at these positions.
    """
    limits = LIMITS_PX[kind]
    is_fitted, *fit = _fit_profile(kind, t, value, weight, blur, start, bool(is_blur_known), *limits, too_many)
    if not is_fitted:
        msg = "the parts of the profile's model cannot be distinguished"
        raise np.linalg.LinAlgError(msg)
    return ProfileFit(*fit)

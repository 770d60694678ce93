"""Models of the mean profile across a flank, each fitted by least squares.

A finger's edge is a step of light, blurred by the optics. Beside the edge there may be a second step (the side wall of
a thick part, between the finger's face and the background), a ramp (a soft shadow on the background) or a bright line
(glare along the edge, on the finger). A side wall, a soft shadow or a line of glare displaces a fitted single step
towards itself.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]

# Models of the structure beside the step. A shadow decreases linearly (SHADOW) or exponentially (FADING); real
# penumbras lie between the two.
STEP, WALL, SHADOW, GLARE, FADING = range(5)
# Starting values and limits of the width in each model (pixels).
STARTS_PX = ((0.0,), (1.5, 3.0, 5.0), (4.0, 8.0, 14.0), (1.0, 2.5, 4.5), (2.0, 4.0, 8.0))
LIMITS_PX = ((0.0, 0.0), (0.8, 10.0), (2.0, 24.0), (0.5, 8.0), (1.0, 16.0))
# Sharpening and the tails of real optics add an antisymmetric part: a step with this multiple of the blur minus the
# step itself.
TAIL_BLURS = 2.2
# Limits of the blur, including the pixel's width (pixels).
LEAST_BLUR_PX, LARGEST_BLUR_PX = 0.3, 5.0
# Largest distance of the edge from the fitted single step (pixels).
FARTHEST_PX = 7.0
# Number of linear parameters (level, contrast, tail, added structure), and of all parameters (also position, blur and
# width).
LINEAR, PARAMETERS = 4, 7
POSITION, BLUR, BREADTH = 4, 5, 6
ITERATIONS, SETTLED = 40, 1e-7
# Least relative reduction of the sum of squares per step, below which a fit that will not be chosen is stopped.
SLOW = 0.01
# Relative standard uncertainty of the blur taken from the picture's other edges.
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

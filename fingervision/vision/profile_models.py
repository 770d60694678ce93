"""Models of the mean profile across a flank, each fitted by least squares.

A finger's edge is a step of light, blurred by the optics. Beside the edge there may be a second step (the side wall of
a thick part, between the finger's face and the background), a ramp (a soft shadow on the background) or a bright line
(glare along the edge, on the finger). A side wall, a soft shadow or a line of glare displaces a fitted single step
towards itself.

Fits of every model to the mean profiles of both inner flanks, each computed when it is first needed.

Fit of an edge with any symmetric blur, to find the part of a mean profile that no symmetric blur explains.

Defocus, motion or a halo blurs a step of light into a profile that is antisymmetric (odd) about the edge, whatever the
shape of the blur. Glare and shadow have profiles with a symmetric (even) part.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.loops import loop
from fingervision.vision.mean_profile import MeanProfile

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


# Mean profile, inverse variance of one pixel, and blur of the single step (pixels).
Flank = tuple[MeanProfile, float, float]

# A model explains a profile if the mean squared residual is below this multiple of the noise's variance, or below this
# fraction of the step's; a step explains it with half of this limit, or with this multiple of the best model's
# residual.
MODEL_LEAVES, MODEL_TIMES, STEP_TIMES = 4.0, 10.0, 3.0
# Multiple of the permitted residual above which a fit is stopped.
HOPELESS_TIMES = 2.0
# Share of the step's blur from which the search also starts, because a structure beside the edge increases the blur of
# a fitted step.
OWN_BLUR = 0.55
RIVALS = (WALL, SHADOW, GLARE)
# Difference in chi-square above which one model is clearly better than another, in units of the residual per bin (odds
# of e^8 to one).
CLEARLY = 16.0


class FlankFits:
    """Fits of the models to both inner flanks.

    Parameters
    ----------
    flanks : list of (MeanProfile, float, float)
        Mean profile, inverse variance of one pixel, and blur of the single step (pixels), for each of the two flanks.
    """

    def __init__(self, flanks: list[Flank]) -> None:
        self._flanks = flanks
        self._fits: dict[tuple[int, int], ProfileFit] = {}
        self._too_many = np.inf
        self.bins = sum(profile.t.size for profile, _, _ in flanks)
        """Number of bins of both profiles."""
        step = self.squares(STEP)
        self.enough = max(MODEL_LEAVES * self.bins, step / MODEL_TIMES)
        """Weighted sum of squared residuals, of both flanks, below which a model explains the profiles."""
        self._too_many = HOPELESS_TIMES * self.enough
        # If a step explains both flanks, no other model is needed; only the blur remains to be checked.
        self._is_explained = step < 0.5 * MODEL_LEAVES * self.bins

    def of(self, kind: int) -> list[ProfileFit]:
        """Fits of a model to the left and the right flank; if a step explains both flanks, those of the step."""
        return [self._fit(kind, k) for k in range(len(self._flanks))]

    def squares(self, kind: int) -> float:
        """Weighted sum of squared residuals of a model, over both flanks."""
        return sum(fit.squares for fit in self.of(kind))

    def margin(self, kind: int) -> float:
        """Difference in the sum of squares by which another model is clearly worse than this model."""
        return CLEARLY * max(self.squares(kind) / self.bins, 1.0)

    def explains(self, kind: int) -> bool:
        """Whether a model explains both flanks; it is not fitted to the second flank if the first excludes it."""
        left = 0.0
        for k in self._worst_first():
            left += self._fit(kind, k).squares
            if not left < self.enough:
                return False
        return True

    def is_step(self) -> bool:
        """Whether a single step explains the profiles, because no other model is clearly better.

        A model that leaves too large a residual on one flank is not fitted to the other flank.
        """
        if self._is_explained:
            return True
        step = self.squares(STEP)
        for kind in RIVALS:
            left = 0.0
            for k in self._worst_first():
                left += self._fit(kind, k).squares
                if step < STEP_TIMES * left:
                    break
            else:
                return False
        return True

    def _worst_first(self) -> list[int]:
        """Numbers of the flanks, that which a step explains worst first."""
        return sorted(range(len(self._flanks)), key=lambda k: -self._fit(STEP, k).squares)

    def _fit(self, kind: int, k: int) -> ProfileFit:
        if kind != STEP and self._is_explained:
            kind = STEP
        if (kind, k) not in self._fits:
            self._fits[kind, k] = best_fit(kind, *self._flanks[k], too_many=self._too_many)
        return self._fits[kind, k]


def best_fit(
    kind: int,
    profile: MeanProfile,
    weight: float,
    blur: float,
    is_blur_known: bool = False,
    too_many: float = np.inf,
) -> ProfileFit:
    """Fit a model from all starting values, and return the best fit.

    Parameters
    ----------
    kind : int
        STEP, WALL, SHADOW, GLARE or FADING.
    profile : MeanProfile
        Mean light across the flank.
    weight : float
        Inverse of the variance of the light of one pixel.
    blur : float
        Blur of the single step (pixels).
    is_blur_known : bool
        Whether the blur is fixed to the given value.
    too_many : float
        Sum of squares above which a fit is stopped early, because the model will not be chosen.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the parts of the model are indistinguishable on this profile.
    """
    weights = profile.count * weight
    blurs = (blur,) if is_blur_known or kind == STEP else (blur, OWN_BLUR * blur)
    return min(
        (
            fit_profile(kind, profile.t, profile.light, weights, own, start, is_blur_known, too_many)
            for own in blurs
            for start in STARTS_PX[kind]
        ),
        key=lambda fit: fit.squares,
    )


# Steps of the free antisymmetric part: half a blur, at least half a pixel (the width of a bin), and their number on
# either side, up to five blurs.
STEP_IN_BLURS, LEAST_STEP_PX, STEPS = 0.5, 0.5, 10
# Number of Gauss-Newton steps for the position of the edge, starting from the half-level.
LOOKS = 4
# Largest distance of the edge from the fitted single step (pixels).
FARTHEST_FROM_STEP_PX = 1.0


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
        if abs(place) > FARTHEST_FROM_STEP_PX:
            break
    return least

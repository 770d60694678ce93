"""Fits of every model to the mean profiles of both inner flanks, each computed when it is first needed."""

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.mean_profile import MeanProfile
from fingervision.vision.profile_models import GLARE, SHADOW, STARTS_PX, STEP, WALL, ProfileFit, fit_profile

Floats = NDArray[np.float64]
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

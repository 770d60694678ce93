"""Mean profiles without the slopes of the light on both sides of the edge, for comparing the widths of edges.

Uneven light makes one flank of a finger appear wider and the other flank sharper: light that increases with the
distance from an edge widens the step, light that decreases sharpens it. The slope of a straight line, fitted on each
side beyond the blur, is subtracted.
"""

from dataclasses import replace

import numpy as np

from fingervision.vision.mean_profile import BIN_PX, MeanProfile

# Distance from the middle of the edge (in blurs) beyond which the edge has no effect, and least number of bins beyond
# this distance to which a slope is fitted.
BEYOND_BLURS, FEWEST_BINS = 2.5, 6


def levelled(profile: MeanProfile, blur_px: float) -> MeanProfile:
    """Return the profile without the slope of the light inside and outside of the edge.

    Parameters
    ----------
    profile : MeanProfile
        Mean light across a flank.
    blur_px : float
        Blur of the flank, pixel width included.
    """
    light = profile.light
    for side in (-1.0, 1.0):
        away = side * profile.t
        is_beyond = away > BEYOND_BLURS * blur_px
        if np.count_nonzero(is_beyond) >= FEWEST_BINS:
            slope = np.polyfit(away[is_beyond], profile.light[is_beyond], 1, w=np.sqrt(profile.count[is_beyond]))[0]
            light = light - slope * np.maximum(away, 0.0)
    return replace(profile, light=light)


def u_squared_width(profile: MeanProfile, weight: float, blur_px: float, displaced_px: float) -> float:
    """Standard uncertainty of the squared width (px^2) of a profile's edge, from noise and codec.

    The module `blur_uncertainty` derives the formula.

    Parameters
    ----------
    profile : MeanProfile
        Mean light across a flank.
    weight : float
        Inverse of the variance of the light of one pixel.
    blur_px : float
        Blur of the flank, pixel width included.
    displaced_px : float
        Standard uncertainty of the edge's position due to a codec (pixels).
    """
    lines = float(profile.count.mean()) / BIN_PX
    by_noise = np.sqrt(4.0 * np.sqrt(np.pi) * blur_px / (lines * weight)) / float(np.ptp(profile.light))
    return 2.0 * blur_px * float(np.hypot(by_noise, np.sqrt(2.0) * displaced_px))

"""Deviations of a finger's flank from a blurred step: a bright rim, or clipped levels.

A rim or clipping moves the fitted edge by the same amount in every row, and leaves a pattern in the residuals of the
fit. The possible displacement of the edge is estimated from the pattern in the residuals and added to the uncertainty.
The edge itself is not corrected, because real optics cause similar patterns, and a correction derived from them would
vary from frame to frame.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]

# Every second row is used, of the half of the flank farther from the tip, where the edge is straightest; least number
# of rows, and least contrast of a row as a share of the usual contrast.
THINNING, FEWEST_ROWS, LEAST_CONTRAST = 2, 6, 0.7
# Widths of the rims that are searched: positive on the background, negative inside the finger (pixels).
RIM_PX = (1.5, 3.0, -2.0)
# Clipped parts of a flank that are searched, as shares of its contrast.
BEYOND = (0.1, 0.4)
# Number of profiles that the fit absorbs (level, contrast, position, blur), index of the position, and number of all
# profiles including the searched ones.
FITTED, POSITION = 4, 2
MARKS = FITTED + len(RIM_PX) + len(BEYOND)
# A rim is significant if it explains this multiple of the noise's variance and has this share of the contrast. The
# clipped part is reduced by this number of standard uncertainties.
SIGNIFICANT, LEAST_SHARE, SURE_SIGMAS = 30.0, 0.02, 1.5
# Least share of a profile's power that the fit does not absorb; with less, the profile cannot be distinguished from an
# edge.
LEAST_OWN = 1e-3
# Blur (including the pixel's width) below which a clipped sharp flank cannot be distinguished from a sharper flank, and
# the possible displacement in this case; even at twice the light, the edge is displaced by less than twice this value.
HIDING_BLUR_PX, HIDDEN_SHIFT_PX = 0.65, 0.25
# Variance of a row's residuals, in units of the noise's variance, above which the row shows dust.
DUSTY = 6.0

_edge_mark = loop("edge_profile_edge_mark")


class EdgeMark(NamedTuple):
    """Deviation of one flank's profile from a blurred step; zero where it is not significant.

    Parameters
    ----------
    shift_px : float
        Possible outward displacement of the fitted edge.
    beyond : float
        Lower bound of the part of the flank that lies beyond the end of the scale, as a share of the contrast.
    """

    shift_px: float
    beyond: float


NO_MARK = EdgeMark(0.0, 0.0)


def edge_mark(
    levels: Floats,
    position: Floats,
    sigma: Floats,
    contrast: Floats,
    mean_square: Floats,
    noise: float,
    top_level: float,
) -> EdgeMark:
    """Estimate the deviation of one flank from a blurred step, and the displacement of the edge that it may cause.

    Parameters
    ----------
    levels : ndarray of float, shape (rows, pixels)
        Grey levels from inside to outside.
    position : ndarray of float, shape (rows,)
        Fitted position of the edge, from the window's middle outwards (pixels).
    sigma : ndarray of float, shape (rows,)
        Fitted blur along the row, without the pixel's width.
    contrast : ndarray of float, shape (rows,)
        Fitted contrast.
    mean_square : ndarray of float, shape (rows,)
        Mean squared residual of each row after the fit (grey levels squared).
    noise : float
        Standard deviation of the grey levels.
    top_level : float
        Highest level of the scale.
    """
    return EdgeMark(*_edge_mark(levels, position, sigma, contrast, mean_square, noise, top_level))

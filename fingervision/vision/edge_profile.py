"""Deviations of a finger's flank from a blurred step: a bright rim, or clipped levels.

A rim or clipping moves the fitted edge by the same amount in every row, and leaves a pattern in the residuals of the
fit. From the pattern it is estimated how far the edge may have moved, which is added to the uncertainty. The edge
itself is not corrected, because real optics cause similar patterns, and a correction derived from them would vary from
frame to frame.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]

# One row in so many is looked at, of the half that lies farther from the tip, where the edge is straightest; there must
# be so many of them, each with most of the usual contrast.
THINNING, FEWEST_ROWS, LEAST_CONTRAST = 2, 6, 0.7
# Widths of the rims that are looked for, on the ground and inside the finger (pixels).
RIM_PX = (1.5, 3.0, -2.0)
# By how much of its contrast the flanks that are looked for lie beyond the end of the scale.
BEYOND = (0.1, 0.4)
# What the fit takes up (level, contrast, position, blur), and with what is looked for.
FITTED, POSITION = 4, 2
MARKS = FITTED + len(RIM_PX) + len(BEYOND)
# A rim counts where it explains so many times the noise's variance, and makes this share of the contrast; what is cut
# off is stated less so many standard uncertainties.
SIGNIFICANT, LEAST_SHARE, SURE_SIGMAS = 30.0, 0.02, 1.5
# A mark that the fit takes up but for this share of its power cannot be told from an edge.
LEAST_OWN = 1e-3
# What is left of a sharp flank far beyond the scale looks like a sharper flank. Where sigma (the pixel included) is
# below this, nobody can tell the two apart: at twice the light the edge is moved by less than twice so much.
HIDING_BLUR_PX, HIDDEN_SHIFT_PX = 0.65, 0.25
# A row that fits worse than this (variance, in units of the noise's) has dust on it.
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

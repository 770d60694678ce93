"""Light along every line of pixels across an outline, and an initial estimate of the edges on these lines."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import LARGEST_BLUR_PX, SMALLEST_BLUR_PX
from fingervision.vision.grey import GreyImage
from fingervision.vision.median import middle
from fingervision.vision.profile_lines import INNER, IS_ROW, ProfileLines

Floats = NDArray[np.float64]

# Half-length of the first window about an edge (pixels), which suffices for the largest blur that can be measured;
# spacing of the lines used; distance of the steepest slope from the middle.
FIRST_REACH_PX, FIRST_LOOK, NEAR_MIDDLE_PX = 20, 6, 8
# Largest displacement of the window towards an edge (pixels), and least difference of the window's end levels.
FIRST_MOVE_PX, LEAST_LEVELS = 2.0, 1e-3

_gather = loop("line_levels_gather")
_steepest_shares = loop("line_levels_steepest_shares")
_first_position = loop("line_levels_first_position")


def line_levels(upright: GreyImage, lines: ProfileLines, light: Floats, reach: int) -> Floats:
    """Light along every line from inside to outside, `reach` pixels to either side, shape (2, PLACES, pixels)."""
    values = np.empty((*lines.fixed.shape, 2 * reach + 1))
    _gather(upright, light, IS_ROW, lines.fixed, lines.coarse, lines.outward, 1, values)
    return values


def first_blur(upright: GreyImage, lines: ProfileLines, light: Floats) -> float:
    """Robust initial estimate of the edges' blur, from the steepest slope in some of the flanks' rows."""
    some = slice(0, INNER, FIRST_LOOK)
    levels = np.empty((len(lines.fixed), len(IS_ROW[some]), 2 * FIRST_REACH_PX + 1))
    flanks = (np.ascontiguousarray(a[:, :INNER]) for a in (lines.fixed, lines.coarse, lines.outward))
    _gather(upright, light, IS_ROW[:INNER], *flanks, FIRST_LOOK, levels)
    shares = np.empty(levels.shape[:2])
    _steepest_shares(levels, shares)
    shares = shares[lines.weight[:, some] > 0]
    if not len(shares):
        return 1.0
    sigma = 1.0 / ndtri(0.5 + min(max(middle(shares), 0.02), 0.49))
    return float(min(max(sigma, SMALLEST_BLUR_PX), LARGEST_BLUR_PX))


def first_position(levels: Floats) -> Floats:
    """Position of a step between the fit window's two end levels for which the window has the observed mean level."""
    position = np.empty(levels.shape[:2])
    _first_position(levels, position)
    return position

"""The light along every line across an outline, and a first look at the edges there."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from fingervision.domain.compiled import compiled
from fingervision.vision.edge_filters import LARGEST_BLUR_PX, SMALLEST_BLUR_PX
from fingervision.vision.grey import GreyImage
from fingervision.vision.median import middle
from fingervision.vision.profile_lines import INNER, IS_ROW, ProfileLines

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Half-length of the first look at an edge (pixels), enough for the strongest blur that is still measured; at one line
# in so many.
FIRST_REACH_PX, FIRST_LOOK, NEAR_MIDDLE_PX = 20, 6, 8
# The window follows an edge so far (pixels), where its ends differ by so many grey levels at all.
FIRST_MOVE_PX, LEAST_LEVELS = 2.0, 1e-3


def line_levels(upright: GreyImage, lines: ProfileLines, light: Floats, reach: int) -> Floats:
    """Light along every line from inside to outside, `reach` pixels to either side, shape (2, PLACES, pixels)."""
    return _gather(upright, light, IS_ROW, lines.fixed, lines.coarse, lines.outward, reach)


@compiled
def _gather(
    upright: GreyImage,
    light: Floats,
    is_row: NDArray[np.bool_],
    fixed: Ints,
    coarse: Ints,
    outward: Ints,
    reach: int,
) -> Floats:
    """Light from inside to outside, `reach` pixels to either side of the coarse edge, shape (2, n, pixels).

    Beyond the picture's border the last pixel is repeated: what is cut off there is a finger's inside or the ground.
    """
    rows, columns = upright.shape
    values = np.empty((fixed.shape[0], fixed.shape[1], 2 * reach + 1))
    for k in range(fixed.shape[0]):
        for i in range(fixed.shape[1]):
            for j in range(2 * reach + 1):
                at = coarse[k, i] + outward[k, i] * (j - reach)
                if is_row[i]:
                    values[k, i, j] = light[upright[fixed[k, i], min(max(at, 0), columns - 1)]]
                else:
                    values[k, i, j] = light[upright[min(max(at, 0), rows - 1), fixed[k, i]]]
    return values


def first_blur(upright: GreyImage, lines: ProfileLines, light: Floats) -> float:
    """Blur of the edges from the steepest place of some of the flanks' rows, robustly."""
    some = slice(0, INNER, FIRST_LOOK)
    levels = _gather(
        upright,
        light,
        IS_ROW[some],
        lines.fixed[:, some],
        lines.coarse[:, some],
        lines.outward[:, some],
        FIRST_REACH_PX,
    )
    shares = _steepest_shares(levels)[lines.weight[:, some] > 0]
    if not len(shares):
        return 1.0
    sigma = 1.0 / ndtri(0.5 + min(max(middle(shares), 0.02), 0.49))
    return float(min(max(sigma, SMALLEST_BLUR_PX), LARGEST_BLUR_PX))


@compiled
def _steepest_shares(levels: Floats) -> Floats:
    """Largest step from pixel to pixel near the middle, as a share of what lies between the ends; shape (2, n)."""
    fingers, lines, pixels = levels.shape
    shares = np.empty((fingers, lines))
    for k in range(fingers):
        for i in range(lines):
            line = levels[k, i]
            steepest, middle = 0.0, pixels // 2
            for j in range(middle - NEAR_MIDDLE_PX, middle + NEAR_MIDDLE_PX + 1):
                steepest = max(steepest, 0.5 * abs(line[j + 1] - line[j - 1]))
            contrast = abs(line[-6:].sum() - line[:6].sum()) / 6.0
            shares[k, i] = steepest / max(contrast, 1.0)
    return shares


@compiled
def first_position(levels: Floats) -> Floats:
    """Where an edge between the window's two end levels would have the same mean level as the window."""
    fingers, lines, pixels = levels.shape
    position = np.empty((fingers, lines))
    for k in range(fingers):
        for i in range(lines):
            line = levels[k, i]
            outside = line[-3:].sum() / 3.0
            contrast = outside - line[:3].sum() / 3.0
            if abs(contrast) < LEAST_LEVELS:
                contrast = LEAST_LEVELS
            share = (outside - line.sum() / pixels) / contrast
            position[k, i] = min(max((share - 0.5) * pixels, -FIRST_MOVE_PX), FIRST_MOVE_PX)
    return position

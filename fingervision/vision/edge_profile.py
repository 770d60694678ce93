"""What the flanks of a finger show that a blurred step does not: a rim, or a flank cut off at the end of the scale.

Either moves the edge that is fitted, the same way in every row, and leaves its own mark in what the fit does not
explain. The mark says how far the edge may have moved, which goes into the uncertainty; the edge itself stays, because
real optics leave marks of their own, and a shift taken from them is not steady from frame to frame.
"""

from math import erf, exp, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.median import middle

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


class EdgeMark(NamedTuple):
    """What one flank shows that a blurred step does not; zero where nothing is significant.

    Parameters
    ----------
    shift_px : float
        How far it may have moved the fitted edge outwards.
    beyond : float
        How much of the flank surely lies beyond the end of the scale, as a share of the contrast.
    """

    shift_px: float
    beyond: float


NO_MARK = EdgeMark(0.0, 0.0)


@compiled
def edge_mark(
    levels: Floats,
    position: Floats,
    sigma: Floats,
    contrast: Floats,
    mean_square: Floats,
    noise: float,
    top_level: float,
) -> EdgeMark:
    """Find a mark in one flank.

    Parameters
    ----------
    levels : ndarray of float, shape (rows, pixels)
        Grey levels from inside to outside.
    position : ndarray of float, shape (rows,)
        Fitted edge, from the window's middle outwards (pixels).
    sigma : ndarray of float, shape (rows,)
        Fitted blur along the row, without the pixel.
    contrast : ndarray of float, shape (rows,)
        Fitted contrast.
    mean_square : ndarray of float, shape (rows,)
        What the fit leaves of each row (grey levels squared).
    noise : float
        Standard deviation of the grey levels.
    top_level : float
        End of the scale.
    """
    rows, pixels = levels.shape
    gram, seen = np.zeros((MARKS, MARKS)), np.zeros(MARKS)
    mark = np.empty(MARKS)
    used, at_end, blur, height = 0, 0, 0.0, 0.0
    usual = middle(np.abs(contrast))
    for i in range(rows // 2, rows, THINNING):
        if mean_square[i] > DUSTY * noise * noise or abs(contrast[i]) < LEAST_CONTRAST * usual:
            continue
        used += 1
        at_end += 1 if levels[i].min() <= 0.0 or levels[i].max() >= top_level else 0
        width = sqrt(sigma[i] ** 2 + 1.0 / 12.0)
        blur += width
        height += abs(contrast[i])
        for j in range(pixels):
            away = j - pixels // 2 - position[i]
            t = away / width
            step = 0.5 + 0.5 * erf(t * sqrt(0.5))
            density = exp(-0.5 * t * t) / sqrt(2.0 * np.pi)
            mark[0], mark[1], mark[2], mark[3] = 1.0, step, density, t * density
            for k in range(len(RIM_PX)):
                mark[FITTED + k] = step - 0.5 - 0.5 * erf((away - RIM_PX[k]) / width * sqrt(0.5))
            for k in range(len(BEYOND)):
                mark[FITTED + len(RIM_PX) + k] = min((1.0 + BEYOND[k]) * step, 1.0) - step
            level = levels[i, j] / contrast[i]
            for a in range(MARKS):
                seen[a] += mark[a] * level
                for b in range(a + 1):
                    gram[a, b] += mark[a] * mark[b]
    if used < FEWEST_ROWS:
        return EdgeMark(0.0, 0.0)
    blur, height = blur / used, height / used
    for a in range(MARKS):
        for b in range(a):
            gram[b, a] = gram[a, b]
    # What the fit takes up of each mark, as level, contrast, position and blur.
    taken_up = np.linalg.solve(gram[:FITTED, :FITTED].copy(), gram[:FITTED, FITTED:].copy())
    # Where the scale ends within the window, that is what is seen; elsewhere nothing can be cut off.
    is_cut = 2 * at_end > used
    best, shift, beyond = SIGNIFICANT * (noise / height) ** 2, 0.0, 0.0
    for k in range(len(RIM_PX), MARKS - FITTED) if is_cut else range(len(RIM_PX)):
        at = FITTED + k
        left, own = seen[at], gram[at, at]
        for a in range(FITTED):
            left -= taken_up[a, k] * seen[a]
            own -= taken_up[a, k] * gram[a, at]
        own = max(own, LEAST_OWN * gram[at, at])
        size, u_size = left / own, noise / (height * sqrt(own))
        moves = -taken_up[POSITION, k] * blur
        if is_cut:  # as large as it may be, and as sure
            shift = min(shift, moves * max(size + u_size, 0.0))
            beyond = max(beyond, BEYOND[k - len(RIM_PX)] * (size - SURE_SIGMAS * u_size))
        elif left * size > best and abs(size) > LEAST_SHARE:
            best, shift = left * size, moves * size
    if is_cut and blur < HIDING_BLUR_PX:
        shift = min(shift, -HIDDEN_SHIFT_PX)
    return EdgeMark(shift, beyond)

"""How far the noise of neighbouring pixels is shared, from the flat parts of the picture beside the edges.

A digital zoom, a colour sensor's demosaicing, denoising and compression spread noise over neighbours. Points of an
outline then share their errors, and many of them know less than they seem to. The autocovariance of the noise says how
much less: the variance of a mean of many lines, each weighted along itself by the edge's own filter, over what it would
be if every line's noise were its own.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.edge_filters import EdgeFilters
from fingervision.vision.grey import GreyImage
from fingervision.vision.profile_lines import INNER, ProfileLines

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Side of the squares that are looked at, how many along each flank, and how far beyond the window they begin (pixels).
SIDE_PX, MOST_ALONG, BEYOND_PX = 16, 3, 1
# Noise is shared over so many pixels: interpolation reaches two, median and bilateral filters three.
LAGS = 3
# The two sides of an edge, each with its own noise: a printed finger's texture is not its ground's.
GROUND, FINGER = 0, 1
# A square whose noise is so many times that of the quietest of its side shows something: an edge, not texture.
QUIETEST_TIMES = 4.0
# Correlations below this many standard uncertainties of their sum are none. The nearest pixels are looked at first:
# where none of their correlations is so many times its own uncertainty, interpolation and filters have shared nothing.
SIGNIFICANT, NEAREST, NEAR_SIGNIFICANT = 3.0, 1, 2.5


def flat_noise(
    upright: GreyImage,
    light: Floats,
    lines: ProfileLines,
    filters: EdgeFilters,
    row: int,
    column: int,
    is_shared_known: bool = False,
) -> tuple[float, float]:
    """Neighbouring lines that share their noise (1 where every line's noise is its own), and that noise.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels, seen with the tips up.
    light : ndarray of float, shape (levels,)
        Light of every grey level.
    lines : ProfileLines
        Where the edges are.
    filters : EdgeFilters
        For the window that is used.
    row, column : int
        Which filter of the table an edge of this blur, in the middle of its window, uses.
    is_shared_known : bool
        Whether a codec shares noise over more lines than are looked at here, so that the noise alone is wanted.

    Returns
    -------
    shared : float
        So many lines count as one.
    noise : float
        Standard deviation of the light in the flat parts; 0 where none is in view.
    """
    corners = _squares(lines.fixed, lines.coarse, lines.weight, filters.reach_px, *upright.shape)
    if not len(corners):
        return 1.0, 0.0
    weight = filters.shift[row, column]
    shared, quietest = 1.0, 0.0
    for side in (GROUND, FINGER):
        own = corners[corners[:, 2] == side]
        covariance, pixels = _autocovariance(upright, light, own, 0 if is_shared_known else NEAREST)
        variance = covariance[LAGS, LAGS] / max(pixels, 1.0)
        if variance <= 0.0:
            continue
        quietest = variance if quietest == 0.0 else min(quietest, variance)
        if is_shared_known or not _is_any(covariance, NEAR_SIGNIFICANT * covariance[LAGS, LAGS] / np.sqrt(pixels)):
            continue
        covariance, pixels = _autocovariance(upright, light, own, LAGS)
        correlation = covariance / covariance[LAGS, LAGS]
        # Each correlation of white noise is uncertain by the root of the number of pixels.
        limit = 1.0 + SIGNIFICANT * float(np.sqrt(2.0 * LAGS / pixels))
        for ratio in (_shared(correlation, weight), _shared(correlation.T.copy(), weight)):
            shared = max(shared, ratio) if ratio > limit else shared
    return shared, float(np.sqrt(quietest))


@compiled
def _squares(fixed: Ints, coarse: Ints, weight: Floats, reach: int, rows: int, columns: int) -> NDArray[np.int64]:
    """First row and column of every square beside both inner flanks, and the side that it is on, shape (n, 3)."""
    found, count = np.empty((4 * MOST_ALONG, 3), dtype=np.int64), 0
    left, right = -columns, 2 * columns
    for i in range(INNER):
        if weight[0, i] > 0.0:
            left = max(left, coarse[0, i])
        if weight[1, i] > 0.0:
            right = min(right, coarse[1, i])
    for k in range(2):
        low, high = np.full(MOST_ALONG, columns), np.full(MOST_ALONG, -1)
        top = rows
        for i in range(INNER):
            if weight[k, i] > 0.0:
                top = min(top, fixed[k, i])
        for i in range(INNER):
            along = (fixed[k, i] - top) // SIDE_PX
            if weight[k, i] > 0.0 and along < MOST_ALONG:
                low[along], high[along] = min(low[along], coarse[k, i]), max(high[along], coarse[k, i])
        for along in range(MOST_ALONG):
            first = top + along * SIDE_PX
            if high[along] < 0 or first + SIDE_PX > rows:
                continue
            # The left finger's ground lies at larger columns, the right one's at smaller ones.
            for start, side in (
                (high[along] + reach + BEYOND_PX, GROUND if k == 0 else FINGER),
                (low[along] - reach - BEYOND_PX - SIDE_PX + 1, FINGER if k == 0 else GROUND),
            ):
                if side == GROUND and (start + SIDE_PX > right - reach if k == 0 else start < left + reach):
                    continue  # the other finger's edge lies in it
                if 0 <= start <= columns - SIDE_PX:
                    found[count, 0], found[count, 1], found[count, 2] = first, start, side
                    count += 1
    return found[:count]


@compiled
def _is_any(covariance: Floats, limit: float) -> bool:
    """Whether a pixel has a covariance beyond this with any of those beside it."""
    across, down = abs(covariance[LAGS + 1, LAGS]), abs(covariance[LAGS, LAGS + 1])
    aslant = max(abs(covariance[LAGS + 1, LAGS + 1]), abs(covariance[LAGS - 1, LAGS + 1]))
    return bool(max(across, down, aslant) > limit)


@compiled
def _autocovariance(
    upright: GreyImage, light: Floats, corners: NDArray[np.int64], farthest: int
) -> tuple[Floats, float]:
    """Sum of the squares' autocovariances, each without its plane of light; and how many pixels they hold.

    Only lags up to `farthest` are summed; the others are left at zero.

    The first index is the lag along a row plus `LAGS`, the second that from row to row.
    """
    n, wide = corners.shape[0], 2 * LAGS + 1
    if n == 0:
        return np.zeros((wide, wide)), 0.0
    squares = np.empty((n, SIDE_PX, SIDE_PX))
    power = np.empty(n)
    mean_square = (SIDE_PX * SIDE_PX - 1.0) / 12.0
    for k in range(n):
        mean, by_row, by_column = 0.0, 0.0, 0.0
        for i in range(SIDE_PX):
            for j in range(SIDE_PX):
                value = light[upright[corners[k, 0] + i, corners[k, 1] + j]]
                squares[k, i, j] = value
                mean += value
                by_row += value * (i - 0.5 * (SIDE_PX - 1))
                by_column += value * (j - 0.5 * (SIDE_PX - 1))
        pixels = SIDE_PX * SIDE_PX
        mean, by_row, by_column = mean / pixels, by_row / pixels / mean_square, by_column / pixels / mean_square
        total = 0.0
        for i in range(SIDE_PX):
            for j in range(SIDE_PX):
                plane = mean + by_row * (i - 0.5 * (SIDE_PX - 1)) + by_column * (j - 0.5 * (SIDE_PX - 1))
                squares[k, i, j] -= plane
                total += squares[k, i, j] ** 2
        power[k] = total
    limit = QUIETEST_TIMES * power.min()
    covariance, used = np.zeros((wide, wide)), 0
    for k in range(n):
        if power[k] > limit:
            continue
        used += 1
        square = squares[k]
        for down in range(farthest + 1):
            for right in range(-farthest, farthest + 1):
                if down == 0 and right < 0:
                    continue
                total = 0.0
                for i in range(SIDE_PX - down):
                    for j in range(max(-right, 0), SIDE_PX - max(right, 0)):
                        total += square[i, j] * square[i + down, j + right]
                # Fewer pairs at larger lags: each as if there were one for every pixel.
                pairs = (SIDE_PX - down) * (SIDE_PX - abs(right))
                covariance[LAGS + right, LAGS + down] += total * SIDE_PX * SIDE_PX / pairs
    for down in range(LAGS + 1):
        for right in range(-LAGS, LAGS + 1):
            covariance[LAGS - right, LAGS - down] = covariance[LAGS + right, LAGS + down]
    return covariance, float(used * SIDE_PX * SIDE_PX)


@compiled
def _shared(correlation: Floats, weight: Floats) -> float:
    """Variance of a mean of lines over that of lines with noise of their own, each summed along itself by `weight`."""
    alone, together = 0.0, 0.0
    for lag in range(-LAGS, LAGS + 1):
        product = 0.0
        for j in range(max(-lag, 0), weight.size - max(lag, 0)):
            product += weight[j] * weight[j + lag]
        alone += product * correlation[LAGS + lag, LAGS]
        for line in range(2 * LAGS + 1):
            together += product * correlation[LAGS + lag, line]
    return together / max(alone, 1e-12)

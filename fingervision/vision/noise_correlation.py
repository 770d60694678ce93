"""Correlation of the noise of neighbouring pixels, estimated in the flat parts of the picture beside the edges.

Digital zoom, demosaicing of a colour sensor, denoising and compression spread noise over neighbouring pixels.
Neighbouring points of an outline then have correlated errors, so that the variance of their mean is larger than for
independent points. The factor by which the variance increases follows from the autocovariance of the noise: the
variance of the mean edge position over many lines, each weighted by the edge's filter, divided by its value for
independent lines.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import EdgeFilters
from fingervision.vision.grey import GreyImage
from fingervision.vision.profile_lines import ProfileLines

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Side of the squares in which noise is estimated, number of squares along each flank, and their distance from the
# window (pixels).
SIDE_PX, MOST_ALONG, BEYOND_PX = 16, 3, 1
# Largest lag at which noise is correlated: two pixels for interpolation, three for median and bilateral filters.
LAGS = 3
# The two sides of an edge are treated separately, because a printed finger has another texture than the background.
GROUND, FINGER = 0, 1
# Ratio of a square's noise to that of the quietest square on the same side above which the square contains an edge.
QUIETEST_TIMES = 4.0
# Number of standard uncertainties below which the sum of the correlations is not significant. The nearest pixels are
# examined first: if none of their correlations exceeds this multiple of its uncertainty, the noise is regarded as
# uncorrelated.
SIGNIFICANT, NEAREST, NEAR_SIGNIFICANT = 3.0, 1, 2.5

_squares = loop("noise_correlation_squares")
_sum_of_lags = loop("noise_correlation_autocovariance")
_shared = loop("noise_correlation_shared")


def flat_noise(
    upright: GreyImage,
    light: Floats,
    lines: ProfileLines,
    filters: EdgeFilters,
    row: int,
    column: int,
) -> tuple[float, float, float]:
    """Number of neighbouring lines that share noise, also on both sides (1 for independent lines); the noise.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels of the picture, turned so that the tips point up.
    light : ndarray of float, shape (levels,)
        Light for every grey level (look-up table).
    lines : ProfileLines
        Lines of pixels across the edges.
    filters : EdgeFilters
        Filters for the length of window used.
    row, column : int
        Indices of the filter for an edge of this blur in the middle of its window.

    Returns
    -------
    shared : float
        Number of neighbouring lines that count as one.
    shared_on_both : float
        The smaller number of finger and ground: a shadow or texture lies on one side, and what was done to the picture
        on both.
    noise : float
        Standard deviation of the light in the flat parts; 0 if no flat part is in view.
    """
    corners = np.empty((4 * MOST_ALONG, 3), dtype=np.int64)
    corners = corners[: _squares(lines.fixed, lines.coarse, lines.weight, filters.reach_px, *upright.shape, corners)]
    if not len(corners):
        return 1.0, 1.0, 0.0
    weight = filters.shift[row, column]
    found, quietest = [1.0, 1.0], 0.0
    for side in (GROUND, FINGER):
        covariance, pixels = _autocovariance(upright, light, corners, side, NEAREST)
        variance = covariance[LAGS, LAGS] / max(pixels, 1.0)
        if variance <= 0.0:
            continue
        quietest = variance if quietest == 0.0 else min(quietest, variance)
        if not _is_any(covariance, NEAR_SIGNIFICANT * covariance[LAGS, LAGS] / np.sqrt(pixels)):
            continue
        covariance, pixels = _autocovariance(upright, light, corners, side, LAGS)
        correlation = covariance / covariance[LAGS, LAGS]
        # The standard uncertainty of a correlation of white noise is the inverse root of the number of pixels.
        limit = 1.0 + SIGNIFICANT * float(np.sqrt(2.0 * LAGS / pixels))
        for ratio in (_shared(correlation, weight), _shared(correlation.T.copy(), weight)):
            found[side] = max(found[side], ratio) if ratio > limit else found[side]
    return max(found), min(found), float(np.sqrt(quietest))


def _is_any(covariance: Floats, limit: float) -> bool:
    """Whether the covariance of a pixel with any of its neighbours exceeds `limit`."""
    beside = ((LAGS + 1, LAGS), (LAGS, LAGS + 1), (LAGS + 1, LAGS + 1), (LAGS - 1, LAGS + 1))
    return any(abs(covariance[place]) > limit for place in beside)


def _autocovariance(
    upright: GreyImage, light: Floats, corners: NDArray[np.int64], side: int, farthest: int
) -> tuple[Floats, float]:
    """Sum of the autocovariances of one side's squares, each detrended by a plane, and their number of pixels.

    Only lags up to `farthest` are computed; entries for larger lags stay zero. The first index is the lag along a row
    plus `LAGS`, the second is the lag in rows.
    """
    covariance = np.empty((2 * LAGS + 1, 2 * LAGS + 1))
    return covariance, _sum_of_lags(upright, light, corners, side, farthest, covariance)

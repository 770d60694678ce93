"""Noise that a codec has left in a picture that was stored without loss afterwards.

The noise of a camera is the same in all parts of the picture that have the same light. A video codec leaves the noise
in some blocks, and removes it from others in which it does not exceed a fraction of the quantiser step. Noise that
differs from block to block by more than chance therefore shows that a codec has changed the picture, and the noise that
is left gives the order of magnitude of the codec's step. Zoom, demosaicing and filters correlate the noise, so that
fewer values in a block are independent and chance differences are larger; the autocovariance of the noise gives their
size.
"""

from functools import lru_cache
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.grey import GreyImage
from fingervision.vision.noise_correlation import LAGS, SIDE_PX

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Number of square tiles (of `noise_correlation.SIDE_PX` pixels) that are distributed evenly over the picture, and least
# number of flat tiles of the same class of light.
TILES, FEWEST = 240, 20
# Degrees of freedom of a tile's noise: its pixels less mean and slopes.
FREE = SIDE_PX * SIDE_PX - 3
# Ratio of a tile's variance to the median above which the tile is not flat; an edge gives much more.
FLAT_TIMES = 4.0
# Quantiles of the tiles' variances that are compared, and their distance in standard deviations of a normal
# distribution; a few tiles with dust or an edge do not count.
LOW, HIGH, APART = 0.1, 0.9, 2.563
# Scatter of the tiles' variances relative to that by chance, above which a codec has changed the picture. Pictures
# without a codec have at most 1.2, after a median filter 1.4 (the classes of `tests.benchmarks.camera_artefacts`);
# saved H.264 of 1 to 4 Mbit/s has 1.2 to 13.
UNEVEN = 1.4
# Least variance of noise in stored levels: that of rounding to whole levels.
ROUNDING = 1.0 / 12.0

_tiles = loop("uneven_noise_tiles")
_sum_of_lags = loop("noise_correlation_autocovariance")


def uneven_noise(grey: GreyImage) -> float:
    """Standard deviation of the noise left by a codec (stored levels); 0 if the noise is the same everywhere.

    Parameters
    ----------
    grey : ndarray, shape (rows, columns)
        Grey levels of a picture that was stored without loss.
    """
    corners = _corners(*grey.shape)
    power, mean = np.empty(len(corners)), np.empty(len(corners))
    _tiles(grey, corners, power, mean)
    ordered = np.sort(mean)
    threshold = 0.5 * (_quantile(ordered, 0.05) + _quantile(ordered, 0.95))
    left = []
    for is_own in (mean > threshold, mean <= threshold):
        own = np.flatnonzero(is_own)
        own = own[np.argsort(power[own])]
        if own.size < FEWEST:
            continue
        own = own[power[own] < FLAT_TIMES * max(float(power[own[own.size // 2]]), ROUNDING)]
        if own.size < FEWEST:
            continue
        low, high = (max(_quantile(power[own], share), ROUNDING) for share in (LOW, HIGH))
        scatter = log(high / low) / APART
        by_chance = sqrt(2.0 / FREE)
        # Correlation only increases the scatter by chance.
        if scatter < UNEVEN * by_chance:
            return 0.0
        if scatter < UNEVEN * by_chance * _root_of_shared(grey, corners[own[own.size // 2 :]]):
            return 0.0
        left.append(high)
    return sqrt(max(left)) if left else 0.0


def _root_of_shared(grey: GreyImage, corners: Ints) -> float:
    """Root of the number of neighbouring pixels with common noise, from the autocovariance in the noisier tiles."""
    covariance = np.empty((2 * LAGS + 1, 2 * LAGS + 1))
    places = np.column_stack((corners, np.zeros(len(corners), dtype=np.int64)))
    _sum_of_lags(grey, _levels(int(np.iinfo(grey.dtype).max) + 1), places, 0, LAGS, covariance)
    power = covariance[LAGS, LAGS]
    return float(np.sqrt(np.sum((covariance / power) ** 2))) if power > 0.0 else 1.0


def _quantile(ordered: Floats, share: float) -> float:
    return float(ordered[int(share * (ordered.size - 1))])


@lru_cache(maxsize=4)
def _levels(count: int) -> Floats:
    return np.arange(count, dtype=np.float64)


@lru_cache(maxsize=8)
def _corners(rows: int, columns: int) -> Ints:
    """First row and column of every tile, shape (n, 2)."""
    down = max(2, round(sqrt(TILES * rows / columns)))
    counts = min(down, rows // SIDE_PX), min(max(2, TILES // down), columns // SIDE_PX)
    places = [
        np.linspace(0, size - SIDE_PX, count).astype(np.int64)
        for size, count in zip((rows, columns), counts, strict=True)
    ]
    return np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 2)

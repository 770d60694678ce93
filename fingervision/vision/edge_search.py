"""Find candidate edges along a direction: extrema of the derivative of a zone's mean profile."""

from dataclasses import dataclass
from functools import lru_cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]

# Least derivative of a step, in standard errors of the profile's derivative, and of the profile's own scatter.
SIGNIFICANT = 6.0
# Least ratio of the steepest slope to the contrast; less is gradual shading. A Gaussian edge of sigma 5 px, the widest
# edge that is measured, has the ratio 0.4 / 5 per pixel.
LEAST_STEEPNESS = 0.05
# Two maxima are two edges if the derivative between them falls below this share of the lower maximum.
VALLEY_SHARE = 0.6
# Share of its maximum to which the derivative falls at the end of a step.
LOBE_SHARE = 0.15
NO_LIGHT: Floats = np.empty(0)

_profile = loop("edge_search_profile")
_steps = loop("edge_search_steps")


@dataclass(frozen=True, slots=True)
class StepCandidate:
    """A candidate edge along the direction in which a zone is searched.

    Parameters
    ----------
    position_px : float
        Position along the direction from the zone's middle, accurate to about half a pixel.
    contrast : float
        Level beyond the edge minus level before it.
    """

    position_px: float
    contrast: float


@dataclass(frozen=True, slots=True, eq=False)
class _Bins:
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    strip: NDArray[np.intp]
    share: Floats
    size: int
    half: int
    count: Floats
    usual: float
    radius_x: int
    radius_y: int


@lru_cache(maxsize=512)
def _bins(direction_rad: float, slope: float, length_px: float, half: int) -> _Bins:
    radius = int(np.ceil(np.hypot(0.5 * length_px * np.hypot(1.0, slope), half + 1.0))) + 1
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    cosine, sine = np.cos(direction_rad), np.sin(direction_rad)
    s = -sine * x + cosine * y
    t = cosine * x + sine * y - slope * s
    # Every pixel is divided between the two nearest strips; whole pixels would cause beats between the pixel grid and
    # the slanted strips.
    strip = np.floor(t).astype(np.intp) + half
    kept = (np.abs(s) <= 0.5 * length_px) & (strip >= 0) & (strip < 2 * half)
    rows, columns = np.nonzero(kept)
    chosen, share = strip[kept], (t - np.floor(t))[kept]
    count = _summed(chosen, share, np.ones(chosen.size), 2 * half + 1)
    rows, columns = rows - radius, columns - radius
    return _Bins(
        rows, columns, chosen, share, 2 * half + 1, half, count, float(np.median(count)),
        int(np.abs(columns).max()), int(np.abs(rows).max()),
    )  # fmt: skip


def _summed(strip: NDArray[np.intp], share: Floats, values: Floats, size: int) -> Floats:
    upper = share * values
    total = np.bincount(strip, values - upper, size).astype(np.float64)
    total[1:] += np.bincount(strip, upper, size)[:-1]
    return total


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Mean level across a zone, as a function of the position along the searched direction.

    Parameters
    ----------
    level : ndarray of float, shape (n,)
        Mean of each pixel-wide strip; meaningless if `weight` is zero.
    weight : ndarray of float, shape (n,)
        Share of each strip's pixels that lie in the picture.
    variance : float
        Variance of the levels within the strips.
    half : int
        Number of strips on either side of the middle one.
    """

    level: Floats
    weight: Floats
    variance: float
    strip_px: float
    half: int


def profile(
    grey: NDArray[np.generic],
    light: Floats | None,
    at_px: tuple[int, int],
    direction_rad: float,
    slope: float,
    length_px: float,
    half: int,
) -> Profile:
    """Mean profile of a zone along a direction.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        The picture.
    light : ndarray of float, shape (levels,), or None
        Light for every level (look-up table); None if the levels are proportional to light.
    at_px : (int, int)
        Column and row of the zone's middle.
    direction_rad, slope : float
        Direction of the profile, and inclination of the edges (change of t with s).
    length_px : float
        Length of the zone across the direction.
    half : int
        Number of strips on either side of the middle one.
    """
    bins = _bins(direction_rad, round(slope, 2), length_px, half)
    height, width = grey.shape
    is_whole = (
        at_px[0] >= bins.radius_x
        and at_px[1] >= bins.radius_y
        and at_px[0] + bins.radius_x < width
        and at_px[1] + bins.radius_y < height
    )
    mean, count = np.empty(bins.size), np.empty(bins.size)
    variance = _profile(
        grey, NO_LIGHT if light is None else light, bins.rows, bins.columns, bins.strip, bins.share, bins.count,
        *at_px, is_whole, mean, count,
    )  # fmt: skip
    return Profile(mean, count / np.maximum(bins.count, 1.0), variance, bins.usual, half)


def candidates(found: Profile) -> list[StepCandidate]:
    """Candidate edges in a profile, in order of position."""
    level = found.level
    if level.size < 5:
        return []
    # Standard error of the difference of strips with the weights 1/4, 1/4, -1/4, -1/4 under independent noise.
    floor = SIGNIFICANT * 0.5 * sqrt((found.variance + 1.0 / 12.0) / max(found.strip_px, 1.0))
    place, contrast = np.empty(level.size), np.empty(level.size)
    _, count = _steps(level, found.weight, floor, place, contrast)
    steps = [
        StepCandidate(at - found.half, size)
        for at, size in zip(place[:count].tolist(), contrast[:count].tolist(), strict=True)
    ]
    return sorted(steps, key=lambda step: step.position_px)

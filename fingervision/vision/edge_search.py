"""Find candidate edges along a direction: lobes of the derivative of a zone's mean profile."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# A step is at least so many standard errors of the profile's derivative, and of the profile's own scatter.
SIGNIFICANT = 6.0
# A Gaussian edge of sigma 5 px, the widest that is measured, has a steepest pixel of 0.4 / 5 of its contrast: what is
# less steep for its size is shade.
LEAST_STEEPNESS = 0.05
# Two maxima are two edges where the derivative between them falls below this share of the lower one.
VALLEY_SHARE = 0.6
# A lobe ends where the derivative has fallen to this share of its maximum.
LOBE_SHARE = 0.15


@dataclass(frozen=True, slots=True)
class StepCandidate:
    """A candidate edge along the zone's direction.

    Parameters
    ----------
    position_px : float
        Along the direction, from the zone's middle, to about half a pixel.
    contrast : float
        Level beyond less level before.
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


@lru_cache(maxsize=512)
def _bins(direction_rad: float, slope: float, length_px: float, half: int) -> _Bins:
    radius = int(np.ceil(np.hypot(0.5 * length_px * np.hypot(1.0, slope), half + 1.0))) + 1
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    cosine, sine = np.cos(direction_rad), np.sin(direction_rad)
    s = -sine * x + cosine * y
    t = cosine * x + sine * y - slope * s
    # Every pixel is shared by the two strips that it lies between: whole pixels would beat with the slanted strips.
    strip = np.floor(t).astype(np.intp) + half
    kept = (np.abs(s) <= 0.5 * length_px) & (strip >= 0) & (strip < 2 * half)
    rows, columns = np.nonzero(kept)
    chosen, share = strip[kept], (t - np.floor(t))[kept]
    count = _summed(chosen, share, np.ones(chosen.size), 2 * half + 1)
    return _Bins(rows - radius, columns - radius, chosen, share, 2 * half + 1, half, count, float(np.median(count)))


def _summed(strip: NDArray[np.intp], share: Floats, values: Floats, size: int) -> Floats:
    upper = share * values
    total = np.bincount(strip, values - upper, size).astype(np.float64)
    total[1:] += np.bincount(strip, upper, size)[:-1]
    return total


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Mean level across a zone.

    Parameters
    ----------
    level : ndarray of float, shape (n,)
        Mean of each pixel-wide strip; meaningless where `weight` is zero.
    weight : ndarray of float, shape (n,)
        Pixels of each strip that lie in the picture, as a share of the strip.
    variance : float
        Variance of the levels within the strips.
    half : int
        Strips to either side of the middle one.
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
    """Mean profile along a direction.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        The picture.
    light : ndarray of float, shape (levels,), or None
        Light of every level; None where it is the level itself.
    at_px : (int, int)
        Column and row of the zone's middle.
    direction_rad, slope : float
        Direction of the profile, and how much the edges lean (change of t with s).
    length_px : float
        Across the direction.
    half : int
        Strips to either side.
    """
    bins = _bins(direction_rad, round(slope, 2), length_px, half)
    rows, columns = bins.rows + at_px[1], bins.columns + at_px[0]
    strip, share, count = bins.strip, bins.share, bins.count
    height, width = grey.shape
    radius_x, radius_y = int(np.abs(bins.columns).max()), int(np.abs(bins.rows).max())
    if (
        at_px[0] < radius_x or at_px[1] < radius_y or at_px[0] + radius_x >= width or at_px[1] + radius_y >= height
    ):  # a part lies outside of the picture
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        rows, columns, strip, share = rows[inside], columns[inside], strip[inside], share[inside]
        count = _summed(strip, share, np.ones(strip.size), bins.size)
    stored = grey[rows, columns]
    levels = stored.astype(np.float64) if light is None else light[stored]
    total = _summed(strip, share, levels, bins.size)
    squares = _summed(strip, share, levels * levels, bins.size)
    safe = np.maximum(count, 1.0)
    mean = total / safe
    inner = np.maximum(squares - total * mean, 0.0)
    full = count > 1.0
    # Strips that an edge lies in spread more, however the edge leans: the middle strip tells what the others do.
    ordered = np.sort(inner[full] / (count[full] - 1.0))
    variance = float(ordered[ordered.size // 2]) if ordered.size else 0.0
    return Profile(mean, count / np.maximum(bins.count, 1.0), variance, bins.usual, half)


def candidates(found: Profile) -> list[StepCandidate]:
    """Candidate edges in a profile, in order of position."""
    level, half = found.level, found.half
    if level.size < 5:
        return []
    seen = found.weight > 0.5
    slope = np.where(seen[1:] & seen[:-1], np.diff(level), 0.0)
    smooth = np.zeros_like(slope)
    smooth[1:-1] = 0.25 * slope[:-2] + 0.5 * slope[1:-1] + 0.25 * slope[2:]
    # Of this difference of strips under independent noise: weights 1/4, 1/4, -1/4, -1/4.
    floor = SIGNIFICANT * 0.5 * np.sqrt((found.variance + 1.0 / 12.0) / max(found.strip_px, 1.0))
    steps: list[StepCandidate] = []
    for sign in (1.0, -1.0):
        steps += _lobes(sign * smooth, sign * slope, sign, floor, half)
    return sorted(steps, key=lambda step: step.position_px)


def _lobes(smooth: Floats, slope: Floats, sign: float, floor: float, half: int) -> list[StepCandidate]:
    peaks: list[int] = []
    is_peak = (smooth[1:-1] >= smooth[:-2]) & (smooth[1:-1] > smooth[2:]) & (smooth[1:-1] > floor)
    for i in (np.flatnonzero(is_peak) + 1).tolist():
        if peaks:
            lower = min(smooth[peaks[-1]], smooth[i])
            if smooth[peaks[-1] : i].min() > VALLEY_SHARE * lower:
                if smooth[i] > smooth[peaks[-1]]:
                    peaks[-1] = i
                continue
        peaks.append(i)
    found = []
    for number, i in enumerate(peaks):
        first, last, limit = i, i, LOBE_SHARE * smooth[i]
        low = peaks[number - 1] if number else 0
        high = peaks[number + 1] if number + 1 < len(peaks) else slope.size - 1
        while first > low and smooth[first - 1] > limit and not (number and smooth[first - 1] > smooth[first]):
            first -= 1
        while (
            last < high
            and smooth[last + 1] > limit
            and not (number + 1 < len(peaks) and smooth[last + 1] > smooth[last])
        ):
            last += 1
        part = smooth[first : last + 1]
        size = float(slope[first : last + 1].sum())
        if size <= 0.0 or smooth[i] < LEAST_STEEPNESS * size:
            continue
        centre = float((np.arange(first, last + 1) * part).sum() / part.sum())
        found.append(StepCandidate(centre + 0.5 - half, sign * size))
    return found

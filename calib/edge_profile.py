"""Mean profile of the stored levels across a straight edge: all its pixels together, in bins narrower than a pixel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Width of a bin across the edge (pixels), smallest number of pixels in a bin, and smallest number of bins of a profile.
BIN_PX, FEWEST_IN_BIN, FEWEST_BINS = 0.2, 8, 24


@dataclass(frozen=True, slots=True, eq=False)
class EdgeProfile:
    """Mean profile of one straight edge over many rows and frames; arrays of shape (n,).

    Parameters
    ----------
    away_px : ndarray of float
        Distance from the fitted edge towards its light side, perpendicular to the edge.
    level : ndarray of float
        Mean stored level, as a share of full scale.
    u_level : ndarray of float
        Standard uncertainty of the mean level.
    side : float
        +1 if the light side has the larger coordinates in the picture, -1 otherwise.
    is_outer : bool
        Whether the edge belongs to the group that decides if the two groups contradict each other.
    """

    away_px: Floats
    level: Floats
    u_level: Floats
    side: float
    is_outer: bool = False

    @property
    def ends(self) -> tuple[float, float]:
        """Levels of the dark and of the light plateau."""
        few = max(3, self.level.size // 8)
        return float(np.median(self.level[:few])), float(np.median(self.level[-few:]))

    @property
    def contrast(self) -> float:
        """Difference of the plateaus' levels."""
        dark, light = self.ends
        return light - dark

    @property
    def overshoot(self) -> float:
        """Largest excursion beyond a plateau by more than its scatter, as a share of the contrast."""
        few = max(3, self.level.size // 8)
        (dark, light), scatter = self.ends, [float(np.std(a)) for a in (self.level[:few], self.level[-few:])]
        beyond = max(self.level.max() - light - 3.0 * scatter[1], dark - 3.0 * scatter[0] - self.level.min())
        return float(max(beyond, 0.0) / max(light - dark, 1e-9))


def binned_profile(
    away_px: Floats, level: Floats, group: NDArray[np.intp], rounding: float, side: float, *, is_outer: bool = False
) -> EdgeProfile | None:
    """Mean profile of the pixels across one edge; None if there are too few.

    Parameters
    ----------
    away_px : ndarray of float, shape (n,)
        Distance of each pixel from the edge.
    level : ndarray of float, shape (n,)
        Stored level, as a share of full scale.
    group : ndarray of int, shape (n,)
        Number of the picture; errors that the pixels of one picture share do not average out within it.
    rounding : float
        Step of the stored levels, as a share of full scale.
    side : float
        +1 if `away_px` increases with the coordinates in the picture, -1 otherwise.
    is_outer : bool
        See `EdgeProfile`.
    """
    place = np.floor(away_px / BIN_PX).astype(int)
    place -= place.min()
    count = np.bincount(place)
    n = np.maximum(count, 1)
    middle, mean = np.bincount(place, away_px) / n, np.bincount(place, level) / n
    # The scatter is computed about a line through each bin, so that the slope of the edge is not counted as noise.
    off = away_px - middle[place]
    slope = np.bincount(place, off * level) / np.maximum(np.bincount(place, off * off), 1e-9)
    left = level - mean[place] - slope[place] * off
    variance = np.bincount(place, left**2) / np.maximum(count - 2, 1)
    of_group = np.zeros((int(group.max()) + 1, count.size))
    np.add.at(of_group, (group, place), left)
    shared = np.sum(of_group**2, axis=0) / n**2
    u_mean = np.sqrt(np.maximum(_smooth(shared), np.maximum(variance, rounding**2 / 12.0) / n))
    full = count >= FEWEST_IN_BIN
    if np.count_nonzero(full) < FEWEST_BINS:
        return None
    middle, mean, u_mean = middle[full], mean[full], u_mean[full]
    if mean[-4:].mean() < mean[:4].mean():  # away from the edge it becomes dark
        return EdgeProfile(-middle[::-1], mean[::-1], u_mean[::-1], -side, is_outer)
    return EdgeProfile(middle, mean, u_mean, side, is_outer)


def _smooth(variance: Floats) -> Floats:
    """Mean over five neighbouring bins: few pictures determine the variance of a single bin poorly."""
    return np.convolve(np.pad(variance, 2, "edge"), np.full(5, 0.2), "valid")

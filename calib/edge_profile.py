"""Mean profile of the stored levels across a straight edge: all its pixels together, in bins narrower than a pixel."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Width of a bin across the edge (pixels), smallest number of pixels in a bin, and smallest number of bins of a profile.
BIN_PX, FEWEST_IN_BIN, FEWEST_BINS = 0.2, 3, 24
# Fewest parts along an edge that tell what lies on it, number of bins over which their variance is averaged, and
# standard deviations by which it must exceed their noise.
FEWEST_PARTS, SMOOTHED, SURE = 3, 7, 5.0


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
    u_structure : ndarray of float
        Standard deviation of the mean level by what lies on the edge (texture, dirt, wear), smooth over a few pixels;
        zero if its parts are alike, empty if that is not known.
    """

    away_px: Floats
    level: Floats
    u_level: Floats
    side: float
    is_outer: bool = False
    u_structure: Floats = field(default_factory=lambda: np.zeros(0))

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
    away_px: Floats,
    level: Floats,
    group: NDArray[np.intp],
    rounding: float,
    side: float,
    *,
    is_outer: bool = False,
    part: NDArray[np.intp] | None = None,
    shared_rows: float = 1.0,
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
    part : ndarray of int, shape (n,), or None
        Number of the part along the edge, the same in all pictures: what lies on the edge does not average out over
        them.
    shared_rows : float
        Number of neighbouring rows that share one error, as far as a single picture tells.
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
    squares, free = (
        np.asarray(each, dtype=np.float64) for each in (np.bincount(place, left**2), np.maximum(count - 2, 0))
    )
    variance = np.maximum(_smooth(squares) / np.maximum(_smooth(free), 0.2), rounding**2 / 12.0)
    of_group = np.zeros((int(group.max()) + 1, count.size))
    np.add.at(of_group, (group, place), left)
    shared = np.sum(of_group**2, axis=0) / n**2
    u_mean = np.sqrt(np.maximum(_smooth(shared), variance * shared_rows / n))
    full = count >= FEWEST_IN_BIN
    if np.count_nonzero(full) < FEWEST_BINS:
        return None
    structure = np.zeros(0) if part is None else _structure(place, left, part, variance, mean, full)
    middle, mean, u_mean = middle[full], mean[full], u_mean[full]
    if mean[-4:].mean() < mean[:4].mean():  # away from the edge it becomes dark
        return EdgeProfile(-middle[::-1], mean[::-1], u_mean[::-1], -side, is_outer, structure[::-1])
    return EdgeProfile(middle, mean, u_mean, side, is_outer, structure)


def _structure(
    place: NDArray[np.intp],
    left: Floats,
    part: NDArray[np.intp],
    variance: Floats,
    mean: Floats,
    full: NDArray[np.bool_],
) -> Floats:
    """Standard deviation of the mean profile by the differences of its parts beyond their noise; zero without any.

    A part may have its own light and its own place: both plateaus, their slopes and the derivative of the profile are
    taken off first.
    """
    bins, parts = np.count_nonzero(full), int(part.max()) + 1
    sums, counts = np.zeros((2, parts, full.size))
    np.add.at(sums, (part, place), left)
    np.add.at(counts, (part, place), 1.0)
    sums, counts = sums[:, full], counts[:, full]
    known = np.minimum(counts, 1.0).sum(axis=1) > 0.75 * bins
    if np.count_nonzero(known) < FEWEST_PARTS:
        return np.zeros(bins)
    sums, counts, noise = sums[known], counts[known], variance[full]
    share = (mean[full] - mean[full].min()) / max(np.ptp(mean[full]), 1e-9)
    at = np.linspace(-1.0, 1.0, bins)
    allowed = np.array([share, 1.0 - share, share * at, (1.0 - share) * at, np.gradient(share)]).T
    found, expected = np.zeros((2, bins))
    for own, count in zip(sums, counts, strict=True):
        weight = np.sqrt(count)
        away = own / np.maximum(weight, 1.0)  # of unit weight: its variance is that of a pixel
        basis = np.linalg.qr(allowed * weight[:, None])[0]
        free = away - basis @ (basis.T @ away)
        # What was taken off is missing in the noise as well.
        found += count * free**2
        expected += count * noise * np.maximum(1.0 - np.sum(basis**2, axis=1), 0.0)
    total = counts.sum(axis=0) ** 2
    excess = np.convolve(found - expected, np.ones(SMOOTHED), "same")
    if float(np.sum(found) / np.sum(expected)) < 1.0 + SURE / np.sqrt(0.5 * bins * len(sums)):
        return np.zeros(bins)
    # Parts that know too few bins may have been the only ones of some bin.
    seen = np.flatnonzero(total)
    own = np.sqrt(np.maximum(excess[seen] / SMOOTHED, 0.0) / total[seen])
    return np.asarray(np.interp(np.arange(bins), seen, own))


def _smooth(variance: Floats) -> Floats:
    """Mean over five neighbouring bins: few pictures determine the variance of a single bin poorly."""
    return np.convolve(np.pad(variance, 2, "edge"), np.full(5, 0.2), "valid")

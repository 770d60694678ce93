"""Mean light across a straight or evenly curved flank: all rows together, in bins narrower than a pixel."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.median import median

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Extent of the mean profile to either side (pixels), width of its bins, and least number of pixels in a bin.
REACH_PX, BIN_PX, FEWEST_IN_BIN = 16, 0.5, 4
# Ratio of the distance of neighbouring fitted rows to the usual distance above which rows were left out deliberately.
LEFT_OUT = 4.0
# Largest standard deviation of a flank's rows about a line (pixels), and least number of rows; for an inner flank, a
# curve is permitted as well. Degrees of the polynomials:
STRAIGHT_PX, FEWEST_ROWS = 0.3, 6
STRAIGHT_ONLY, STRAIGHT_OR_ROUND = (1,), (1, 4)
# Number of fits, factor from median deviation to standard deviation, and distance beyond which rows are excluded as
# dust: this number of standard deviations plus a small distance (pixels).
LOOKS, SIGMAS_IN_MEDIAN, DUST, LEAST_DUST_PX = 3, 1.4826, 3.0, 1e-3

_bins, _robust_line = loop("mean_profile_bins"), loop("mean_profile_robust_line")


@dataclass(frozen=True, slots=True, eq=False)
class MeanProfile:
    """Mean light across a flank: distances outwards from the fitted step, light, and number of pixels, for each bin."""

    t: Floats
    light: Floats
    count: Floats


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line with the interface of NumPy's polynomials, but much faster to evaluate.

    Parameters
    ----------
    intercept : float
        Value at zero.
    slope : float
        Change per unit.
    """

    intercept: float
    slope: float

    def __call__(self, at: Ints) -> Floats:
        """Values of the line at given positions, shape (n,)."""
        return np.asarray(self.intercept + self.slope * at, dtype=np.float64)

    def deriv(self) -> "Line":
        """Derivative of the line, which is constant."""
        return Line(self.slope, 0.0)


def mean_profile(
    upright: GreyImage,
    edges: EdgePoints,
    light: Floats,
    k: int,
    part: slice,
    room: int,
    curves: tuple[int, ...] = STRAIGHT_ONLY,
) -> MeanProfile | None:
    """Mean profile across the half of a flank farther from the tip; None if that half is short or not smooth."""
    real = np.flatnonzero(edges.lines.weight[k, part] > 0)
    rows = real[real.size // 2 :]
    if rows.size < FEWEST_ROWS or room < REACH_PX // 2:
        return None
    fixed, found = edges.lines.fixed[k, part][rows], edges.position[k, part][rows]
    outward = int(edges.lines.outward[k, part][0])
    curve: Line | Polynomial
    for degree in curves:
        keep = np.ones(rows.size, dtype=bool)
        if degree == 1:
            seen, intercept, slope, spread = _robust_line(fixed, found, keep)
            if seen < FEWEST_ROWS:
                return None
            curve = Line(intercept, slope)
        else:
            for _look in range(LOOKS):
                curve = Polynomial.fit(fixed[keep], found[keep], degree)
                away = found - curve(fixed)
                spread = SIGMAS_IN_MEDIAN * median(np.abs(away[keep]))
                keep = np.abs(away) < DUST * spread + LEAST_DUST_PX
                if np.count_nonzero(keep) < FEWEST_ROWS + degree - 1:
                    return None
        if spread <= STRAIGHT_PX:
            break
    else:
        return None
    between = _rows_between(fixed[keep])
    edge, slopes = curve(between), curve.deriv()(between)
    count, distance, total = np.empty((3, int((3 * REACH_PX + room + 2) / BIN_PX)))
    _bins(upright, light, between, edge, slopes, outward, room, count, distance, total)
    full = count >= FEWEST_IN_BIN
    if not full.any():  # few rows of a slanted flank
        return None
    return MeanProfile(distance[full] / count[full], total[full] / count[full], count[full])


def _rows_between(looked_at: Ints) -> Ints:
    """Every row between the first and the last fitted row, including rows that were left out to save time.

    Long gaps between fitted rows are not filled, because a part hides the edge in these rows.
    """
    looked_at = np.sort(looked_at)
    rows, steps = np.arange(looked_at[0], looked_at[-1] + 1), np.diff(looked_at).astype(np.float64)
    most = LEFT_OUT * median(steps)
    if steps.max() <= most:
        return rows
    after = np.searchsorted(looked_at, rows)
    before = looked_at[np.maximum(np.searchsorted(looked_at, rows, side="right") - 1, 0)]
    return np.asarray(rows[looked_at[after] - before <= most])

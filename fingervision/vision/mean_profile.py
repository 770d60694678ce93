"""Mean light across a straight or evenly curved flank: all rows together, in bins narrower than a pixel."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from fingervision.vision.edges import EdgePoints
from fingervision.vision.first_guess import line
from fingervision.vision.grey import GreyImage
from fingervision.vision.median import median

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# The mean profile reaches so far to either side (pixels), in bins of this breadth with so many pixels each.
REACH_PX, BIN_PX, FEWEST_IN_BIN = 16, 0.5, 4
# Rows are left out on purpose where their neighbours lie so many times as far apart as usual.
LEFT_OUT = 4.0
# A flank is known where its rows lie this near to a line (pixels, standard deviation), over so many of them; an inner
# one also where they lie so near to a curve. The degrees that are tried:
STRAIGHT_PX, FEWEST_ROWS = 0.3, 6
STRAIGHT_ONLY, STRAIGHT_OR_ROUND = (1,), (1, 4)


@dataclass(frozen=True, slots=True, eq=False)
class MeanProfile:
    """Mean light across a flank: distances outwards from the fitted step, light, and number of pixels, for each bin."""

    t: Floats
    light: Floats
    count: Floats


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
    for degree in curves:
        keep = np.ones(rows.size, dtype=bool)
        for _look in range(3):
            if degree == 1:  # a hundred times faster
                curve = Polynomial(line(fixed[keep].astype(np.float64), found[keep]))
            else:
                curve = Polynomial.fit(fixed[keep], found[keep], degree)
            away = found - curve(fixed)
            spread = 1.4826 * median(np.abs(away[keep]))
            keep = np.abs(away) < 3.0 * spread + 1e-3
            if np.count_nonzero(keep) < FEWEST_ROWS + degree - 1:
                return None
        if spread <= STRAIGHT_PX:
            break
    else:
        return None
    fixed = _rows_between(fixed[keep])
    edge, slope = curve(fixed), curve.deriv()(fixed)[:, None]
    columns = np.rint(edge).astype(int)[:, None] + outward * np.arange(-REACH_PX, room + 1)
    is_in = (columns >= 0) & (columns < upright.shape[1])
    values = light[upright[np.broadcast_to(fixed[:, None], columns.shape)[is_in], columns[is_in]]]
    t = (outward * (columns - edge[:, None]) / np.hypot(1.0, slope))[is_in]
    place = np.floor(t / BIN_PX).astype(int) + int(2.0 * REACH_PX / BIN_PX)
    count = np.bincount(place)
    full = count >= FEWEST_IN_BIN
    total, middle = np.bincount(place, values), np.bincount(place, t)
    return MeanProfile(middle[full] / count[full], total[full] / count[full], count[full].astype(np.float64))


def _rows_between(looked_at: Ints) -> Ints:
    """Every row between the first and the last fitted one, including rows left out to save time.

    Long gaps between fitted rows are not filled, because a part hides the edge there.
    """
    looked_at = np.sort(looked_at)
    rows, steps = np.arange(looked_at[0], looked_at[-1] + 1), np.diff(looked_at).astype(np.float64)
    most = LEFT_OUT * median(steps)
    if steps.max() <= most:
        return rows
    after = np.searchsorted(looked_at, rows)
    before = looked_at[np.maximum(np.searchsorted(looked_at, rows, side="right") - 1, 0)]
    return np.asarray(rows[looked_at[after] - before <= most])

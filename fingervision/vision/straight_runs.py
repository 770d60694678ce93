"""Division of a chain of points into straight runs: the best piecewise line with a penalty for every run.

Dynamic programming over all divisions of the chain (Bellman & Roth, JASA 64, 1969, doi:10.1080/01621459.1969.10501038),
with total least squares as the cost of a run, computed from the chain's cumulative moments. A point may be left out of
all runs at the cost of a penalty.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.median import median

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Least number of points of a run; the noise is estimated from lines through the same number of neighbouring points.
FEWEST_POINTS = 5
# Least reduction of chi-square by a further run: odds of e^12 to one, plus the three parameters of the run.
PRICE_OF_RUN = 27.0
# Penalty (chi-square) for a point that is left out; points beyond about 2.5 standard deviations are left out.
PRICE_OF_POINT = 6.0
# Ratio of the median to the mean of chi-square with three degrees of freedom, for the windows from which the noise is
# estimated.
MEDIAN_OF_CHI_SQUARE = 0.79


_squares, _windows = loop("straight_runs_squares"), loop("straight_runs_windows")
_cheapest = loop("straight_runs_cheapest")


def straight_runs(x: Floats, y: Floats, u: Floats) -> list[Ints]:
    """Divide a chain of points into straight runs.

    Parameters
    ----------
    x, y : ndarray of float, shape (n,)
        Positions of the points in the order of the chain (pixels).
    u : ndarray of float, shape (n,)
        Standard uncertainty of each point across its run, in any common unit.

    Returns
    -------
    list of ndarray of int
        Indices of each run's points, in order; points that belong to no run are left out.
    """
    n = x.size
    if n < FEWEST_POINTS:
        return []
    w, x0, y0 = u**-2.0, x - x.mean(), y - y.mean()
    terms = np.column_stack((w, w * x0, w * y0, w * x0 * x0, w * x0 * y0, w * y0 * y0))
    sums = np.vstack((np.zeros(6), np.cumsum(terms, axis=0)))
    squares = np.empty(n - FEWEST_POINTS + 1)
    _windows(sums, squares)
    chi_square = squares / (FEWEST_POINTS - 2)
    noise = max(median(chi_square) / MEDIAN_OF_CHI_SQUARE, 1e-12)
    starts = np.empty(n + 1, dtype=np.int64)
    _cheapest(sums, noise, starts)
    last_run = starts.tolist()
    runs, k = [], n
    while k > 0:
        if last_run[k] < 0:
            k -= 1
        else:
            runs.append(np.arange(last_run[k], k))
            k = last_run[k]
    return _joined(runs[::-1], terms, noise)


def _joined(runs: list[Ints], terms: Floats, noise: float) -> list[Ints]:
    """Join runs that lie on one straight line: the omitted points between them were dust."""
    joined: list[Ints] = []
    for run in runs:
        if joined:
            both = np.concatenate((joined[-1], run))
            whole, first, second = (_squares(terms[points].sum(axis=0)) for points in (both, joined[-1], run))
            if whole - (first + second) < PRICE_OF_RUN * noise:
                joined[-1] = both
                continue
        joined.append(run)
    return joined

"""Correlation of residuals along rows: the number of neighbouring rows that count as one independent row."""

import numpy as np
from numpy.typing import NDArray

# Largest lag of the correlation, as a share of the number of rows.
LONGEST_PART = 0.25


def rows_in_one(residual: NDArray[np.float64]) -> float:
    """Return the integrated correlation time of residuals in rows, at least 1.

    The variance of a mean over n rows is the variance of one row times the correlation time, divided by n. The sum over
    lags stops where the sum of two neighbouring correlations becomes negative (Geyer's initial positive sequence,
    Statistical Science 7(4), 1992, 473-483).

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Residuals about a straight line, row by row.
    """
    count = residual.size
    power = float(residual @ residual)
    if count < 8 or power <= 0.0:
        return 1.0
    lags = int(LONGEST_PART * count)
    correlation = np.array([float(residual[: count - lag] @ residual[lag:]) for lag in range(lags + 1)]) / power
    pairs = correlation[: lags + 1 - (lags + 1) % 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0.0)
    total = float(pairs[: negative[0] if negative.size else pairs.size].sum())
    return max(1.0, 2.0 * total - 1.0)

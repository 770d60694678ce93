"""Number of independent values in a residual whose neighbouring rows are correlated."""

import numpy as np

from fingervision.domain.effect import Array


def independent_values(residual_mm: Array, runs: tuple[slice, ...]) -> float:
    """Number of independent values whose mean is as certain as the mean of the correlated residual.

    The number of independent values is the number of rows divided by the integrated autocorrelation, which is summed up
    to its first zero (Sokal, in Functional Integration, 1997, doi:10.1007/978-1-4899-0319-8_6).

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Residual of one channel. The mean of each run is removed.
    runs : tuple of slice
        Rows of each run.
    """
    parts = [residual_mm[run] - residual_mm[run].mean() for run in runs]
    longest = max(part.size for part in parts)
    products = np.zeros(longest)
    for part in parts:
        products[: part.size] += np.correlate(part, part, "full")[part.size - 1 :]
    correlation = products / max(float(products[0]), 1e-300)
    negative = np.flatnonzero(correlation <= 0.0)
    zero = int(negative[0]) if negative.size else longest
    return float(residual_mm.size / (1.0 + 2.0 * correlation[1:zero].sum()))

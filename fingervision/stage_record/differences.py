"""Differences of a record along its own times, in which a smooth motion vanishes even where rows are uneven."""

from math import comb

import numpy as np

from fingervision.domain.effect import Array

EVEN = 1e-6
"""Relative spread of the time steps below which the steps are equal within the digits of the file."""


def differences(values: Array, time_s: Array, order: int) -> Array:
    """Take differences of a given order of a record: zero for every polynomial in time of a lower degree.

    These are divided differences (Newton), scaled to the noise gain of ordinary differences, binom(2k, k)^(1/2). With
    equal steps they are equal to ordinary differences. For rows that are missing or late, ordinary differences would
    contain speed times delay.

    Parameters
    ----------
    values, time_s : ndarray of float, shape (n,)
        Record of one run; times increase.
    order : int
        1 or more.

    Returns
    -------
    ndarray of float, shape (n - order,), or (0,)
    """
    count = values.size - order
    if count <= 0:
        return np.zeros(0)
    steps = np.diff(time_s)
    if float(np.ptp(steps)) <= EVEN * float(steps.mean()):
        return np.asarray(np.diff(values, order))
    weights = np.ones((order + 1, count))
    for j in range(order + 1):
        for i in range(order + 1):
            if i != j:
                weights[j] *= steps.mean() / (time_s[j : j + count] - time_s[i : i + count])
    weights *= np.sqrt(comb(2 * order, order) / np.sum(weights**2, axis=0))
    return np.asarray(np.sum([weights[j] * values[j : j + count] for j in range(order + 1)], axis=0))

"""Penalties of parameters whose prior is known better than BIC assumes: places, and start states of runs.

A place, such as that of an end stop, may be anywhere between its bounds.

A stage that has moved further than its play has taken the play up, on one side or the other. Runs that were recorded
alike begin alike: the probabilities of the two ends, and of the states between them, are unknown, and the runs before
show them (urn of Pólya; Johnson & Kotz 1977).
"""

import numpy as np

from fingervision.domain.effect import Array
from fingervision.domain.parameter import Parameter

START_VARIANCE = 1.0 / 3.0
"""Variance of a start state that is uniformly distributed between -1 and 1."""
ENDS = (-1.0, 1.0)


def inner_price(curvature: Array, rows: int) -> Array:
    """-2 log of the posterior width of start states over their prior width, if they are uniform between the ends.

    It is at most the penalty of a free parameter; otherwise a play would be less probable than two effects that imitate
    it.

    Parameters
    ----------
    curvature : ndarray of float, shape (p,)
        Half the second derivatives of chi-square with respect to the start states.
    rows : int
        Number of measured values.
    """
    # Rounding may leave a curvature that is zero slightly below zero.
    return np.asarray(np.minimum(np.log1p(np.maximum(curvature, 0.0) * START_VARIANCE), np.log(rows)))


def places_price(listed: list[tuple[str, Parameter]], covariance: Array, rows: int) -> float:
    """-2 log of the probability that places lie by chance where they were found, beyond their penalty in BIC.

    For a prior that is uniform between the bounds, their distance is divided by the posterior's width (Laplace's
    method). An end stop 0.05 mm within a range of 21 mm imitated the play of a stage that was read one way.

    Parameters
    ----------
    listed : list of (str, Parameter)
        Names of the effects, and their parameters.
    covariance : ndarray of float, shape (p, p)
        Covariance of the parameters; zero for a parameter at a bound, which is no free place.
    rows : int
        Number of measured values.
    """
    total = 0.0
    for (_, parameter), variance in zip(listed, np.diag(covariance), strict=True):
        if parameter.place and variance > 0.0:
            width2 = 2.0 * np.pi * variance
            total += max(0.0, float(np.log((parameter.upper - parameter.lower) ** 2 / width2 / rows)))
    return total


def starts_price(listed: list[tuple[str, Parameter]], x: Array, curvature: Array, rows: int) -> float:
    """-2 log of the prior probability of fitted start states, relative to their likelihood.

    Parameters
    ----------
    listed : list of (str, Parameter)
        Names of the effects, and their parameters.
    x, curvature : ndarray of float, shape (p,)
        Fitted parameters, and half the second derivatives of chi-square.
    rows : int
        Number of measured values.
    """
    inner, total = inner_price(curvature, rows), 0.0
    begun: dict[str, Array] = {}
    for (name, parameter), value, bend, price in zip(listed, x, curvature, inner, strict=True):
        if parameter.run is None:
            continue
        if not parameter.at_ends:
            total += float(price)
            continue
        likely = np.exp(-0.5 * np.array([*(max(bend, 0.0) * (value - end) ** 2 for end in ENDS), price]))
        seen = begun.setdefault(name, np.ones(likely.size))
        share = likely * seen / seen.sum()
        total -= 2.0 * float(np.log(share.sum()))
        seen += share / share.sum()
    return total

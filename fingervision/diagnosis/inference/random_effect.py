"""Random effects of an explanation, by which gains of runs and maps of position errors are estimated.

A random effect is a set of columns whose coefficients are independent standard normal numbers (Laird & Ware 1982,
doi:10.2307/2529876); they are integrated out of the likelihood and estimated afterwards.
"""

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.domain.effect import Array

LEAST_GAIN = 10.0
"""Least gain of a random effect beyond its penalty: twice the logarithm of a Bayes factor that is very strong evidence
(Kass & Raftery 1995, doi:10.1080/01621459.1995.10476572)."""


def normal_equations(problem: Problem, explanation: Explanation, raw_mm: Array) -> tuple[Array, Array]:
    """Normal equations for the columns of a random effect and an explanation, with the runs' offsets integrated out.

    Parameters
    ----------
    problem : Problem
        Estimation problem without the columns.
    explanation : Explanation
        Explanation whose residual the columns should explain.
    raw_mm : ndarray of float, shape (m, k)
        Change of the prediction per unit of each coefficient.

    Returns
    -------
    matrix : ndarray of float, shape (k, k)
        Normal matrix of the whitened columns.
    right : ndarray of float, shape (k,)
        Products of the whitened columns and the residual.
    """
    offsets, metric = problem.offsets, problem.offsets.metric(explanation.sigma_mm)
    white = problem.whitener.columns(raw_mm)[0]
    beside = white - offsets.design @ (metric @ (offsets.design.T @ white))
    return white.T @ beside, beside.T @ explanation.residual


def estimated_coefficients(problem: Problem, explanation: Explanation, count: int, behind: int) -> tuple[Array, Array]:
    """Estimate the coefficients of a random effect, given an explanation.

    Parameters
    ----------
    problem : Problem
        Estimation problem whose refitted columns include those of the random effect.
    explanation : Explanation
        Explanation whose residual the random effect explains.
    count, behind : int
        Number of columns of the effect, and number of columns of other random effects that follow them.

    Returns
    -------
    coefficients : ndarray of float, shape (count,)
        Posterior mean.
    covariance : ndarray of float, shape (count, count)
        Posterior covariance.
    """
    metric = problem.offsets.metric(explanation.sigma_mm)
    every = metric @ (problem.offsets.design.T @ explanation.residual)
    own = slice(every.size - behind - count, every.size - behind)
    return np.asarray(every[own], dtype=np.float64), np.asarray(metric[own, own], dtype=np.float64)

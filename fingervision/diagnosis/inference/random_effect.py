"""Random effects of an explanation, by which gains of runs and maps of position errors are estimated.

A random effect is a set of columns whose coefficients are independent standard normal numbers (Laird & Ware 1982,
doi:10.2307/2529876); they are integrated out of the likelihood and estimated afterwards.
"""

from dataclasses import dataclass, replace

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
    beside = offsets.beside(white, metric)
    return white.T @ beside, beside.T @ explanation.residual


MAP, GAINS, DRAWING, PATH, FORM = "map", "gains", "drawing", "path", "form"
"""Names of the random effects beside an explanation: map of position errors, gains of the runs, uncertain dimensions of
the drawing, errors of the path, and errors of formulas."""


def estimated_coefficients(problem: Problem, explanation: Explanation, *names: str) -> tuple[Array, Array]:
    """Estimate the coefficients of random effects, given an explanation.

    Parameters
    ----------
    problem : Problem
        Estimation problem whose refitted columns include those of the random effect.
    explanation : Explanation
        Explanation whose residual the random effect explains.
    names : str
        Names of the random effects in the problem.

    Returns
    -------
    coefficients : ndarray of float, shape (k,)
        Posterior mean.
    covariance : ndarray of float, shape (k, k)
        Posterior covariance.
    """
    metric = problem.offsets.metric(explanation.sigma_mm)
    every = metric @ (problem.offsets.design.T @ explanation.residual)
    # The columns of the random effects are the last ones.
    owners = [name for name, count in problem.random for _ in range(count)]
    own = every.size - len(owners) + np.flatnonzero([name in names for name in owners])
    return np.asarray(every[own], dtype=np.float64), np.asarray(metric[np.ix_(own, own)], dtype=np.float64)


def evidence_of(gram: Array, aim: Array) -> float:
    """Twice the log of the marginal likelihood with columns of a random effect over that without them.

    Parameters
    ----------
    gram, aim : ndarray of float, shape (k, k) and (k,)
        Normal equations of the columns (`normal_equations`).
    """
    inner = np.eye(aim.size) + gram
    return float(aim @ np.linalg.solve(inner, aim) - np.linalg.slogdet(inner)[1])


FEWEST_RUNS = 2
"""Least number of runs: a single run has no scatter of gains."""
SIZES = np.geomspace(1e-4, 0.2, 34)
"""Standard deviations of the gain that are tried; runs that differ by more than a fifth are not one experiment."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RandomEffect:
    """A random effect with its estimated coefficients.

    Parameters
    ----------
    columns_mm : ndarray of float, shape (channels * n, k)
        Change of the prediction per standard deviation of each coefficient.
    price : float
        Penalty on the scale of chi-square: logarithm of the determinant, and of the choice of the columns' size.
    coefficients : ndarray of float, shape (k,)
        Estimated coefficients, in standard deviations.
    """

    columns_mm: Array
    price: float
    coefficients: Array

    @property
    def fitted_mm(self) -> Array:
        """Change of the prediction by the estimated coefficients, to first order; shape (channels * n,)."""
        return np.asarray(self.columns_mm @ self.coefficients, dtype=np.float64)


def gains_by_size(gram: Array, aim: Array, sizes: Array) -> Array:
    """Reduction of -2 log of the marginal likelihood by a random effect, for each size of its columns; shape (sizes,).

    Parameters
    ----------
    gram, aim : ndarray of float, shape (k, k) and (k,)
        Normal equations of columns of unit size.
    sizes : ndarray of float, shape (sizes,)
        Standard deviations of the coefficients.
    """
    value, vector = np.linalg.eigh(gram)
    value, share = np.maximum(value, 0.0), (vector.T @ aim) ** 2
    load = 1.0 + sizes[:, None] ** 2 * value
    return np.asarray(np.sum(sizes[:, None] ** 2 * share / load - np.log(load), axis=1))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunGains(RandomEffect):
    """Gains of the runs as a random effect, with one coefficient for each run.

    Parameters
    ----------
    sd : float
        Standard deviation of the gain from run to run, as a ratio.
    """

    sd: float

    @property
    def each(self) -> str:
        """Estimated gains of the runs, in words."""
        return ", ".join(f"{100.0 * self.sd * number:+.2g}" for number in self.coefficients) + " %"

    @property
    def words(self) -> str:
        """Sentence with the estimated scatter of the runs' gains."""
        return (
            f"the gain differs from run to run (by {self.each}): this counts as scatter between the runs, like their "
            "offsets, and not as an effect."
        )

    def refitted(self, problem: Problem, explanation: Explanation) -> "RunGains":
        """Estimate the runs' gains for an explanation."""
        return replace(self, coefficients=estimated_coefficients(problem, explanation, GAINS)[0])


def likeliest_gains(problem: Problem, explanation: Explanation) -> tuple[RunGains, float]:
    """Estimate the scatter of the runs' gains for an explanation.

    Parameters
    ----------
    problem : Problem
        Estimation problem without such gains.
    explanation : Explanation
        Explanation whose residual the gains should explain, and whose prediction they multiply.

    Returns
    -------
    found : RunGains
        The most probable gains.
    gain : float
        Reduction of -2 log of the marginal likelihood, minus the gains' penalty.
    """
    history = problem.chain.history
    n = history.input_mm.size
    gap_mm = problem.chain.stacked(explanation.values)[:n]
    raw = np.zeros((problem.measured.size, len(history.runs)))
    for column, run in enumerate(history.runs):
        # A gain acts about the mean of its run, because its remaining part is an offset.
        raw[run, column] = gap_mm[run] - gap_mm[run].mean()
    gram, aim = normal_equations(problem, explanation, raw)
    gained = gains_by_size(gram, aim, SIZES)
    best = int(np.argmax(gained))
    size = float(SIZES[best])
    choice = float(np.log(max(2, problem.measured.size)))
    inner = np.eye(aim.size) + size**2 * gram
    found = RunGains(
        columns_mm=raw * size,
        sd=size,
        price=float(np.linalg.slogdet(inner)[1]) + choice,
        coefficients=np.asarray(np.linalg.solve(inner, size * aim), dtype=np.float64),
    )
    return found, float(gained[best]) - choice

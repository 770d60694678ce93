"""Gains that differ from run to run: a random effect on the ratio of gap to input, added to every explanation.

For example, a part that is clamped again for each run, or a polymer at another temperature, moves by slightly more or
less in each run. Like the offsets of runs, the gains of runs are zero-mean random effects (Laird & Ware 1982,
doi:10.2307/2529876), because their common mean is a ratio error, which is an effect of the catalogue.
"""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.random_effect import estimated_coefficients, normal_equations
from fingervision.domain.effect import Array

FEWEST_RUNS = 2
"""Least number of runs: a single run has no scatter of gains."""
SIZES = np.geomspace(1e-4, 0.2, 34)
"""Standard deviations of the gain that are tried; runs that differ by more than a fifth are not one experiment."""


@dataclass(frozen=True, slots=True, eq=False)
class RunGains:
    """Gains of the runs as a random effect.

    Parameters
    ----------
    columns_mm : ndarray of float, shape (channels * n, runs)
        Change of the prediction per standard deviation of each run's gain.
    sd : float
        Standard deviation of the gain from run to run, as a ratio.
    price : float
        Penalty on the scale of chi-square: logarithm of the determinant, and of the choice of `sd`.
    coefficients : ndarray of float, shape (runs,)
        Estimated gains in units of `sd`.
    """

    columns_mm: Array
    sd: float
    price: float
    coefficients: Array

    @property
    def fitted_mm(self) -> Array:
        """Change of the prediction by the estimated gains; shape (channels * n,)."""
        return np.asarray(self.columns_mm @ self.coefficients, dtype=np.float64)

    @property
    def scatter_mm(self) -> Array:
        """Change of the prediction by the gains' deviations from their mean."""
        return np.asarray(self.columns_mm @ (self.coefficients - self.coefficients.mean()), dtype=np.float64)

    def without_mean(self) -> "RunGains":
        """Remove the gains' common mean, which is an effect of the catalogue."""
        shared = np.full((self.coefficients.size,) * 2, 1.0 / self.coefficients.size)
        return replace(self, columns_mm=self.columns_mm - self.columns_mm @ shared)

    @property
    def words(self) -> str:
        """Sentence with the estimated scatter of the runs' gains."""
        each = ", ".join(f"{100.0 * self.sd * number:+.2g}" for number in self.coefficients - self.coefficients.mean())
        return (
            f"the gain differs from run to run (by {each} %): this counts as scatter between the runs, like their "
            "offsets, and not as an effect."
        )

    def refitted(self, problem: Problem, explanation: Explanation, behind: int) -> "RunGains":
        """Estimate the runs' gains for an explanation; `behind` is the number of columns after those of the gains."""
        return replace(
            self, coefficients=estimated_coefficients(problem, explanation, self.coefficients.size, behind)[0]
        )


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
    value, vector = np.linalg.eigh(gram)
    value, share = np.maximum(value, 0.0), (vector.T @ aim) ** 2
    load = 1.0 + SIZES[:, None] ** 2 * value
    gained = np.sum(SIZES[:, None] ** 2 * share / load - np.log(load), axis=1)
    best = int(np.argmax(gained))
    size = float(SIZES[best])
    choice = float(np.log(max(2, problem.measured.size)))
    inner = np.eye(value.size) + size**2 * gram
    found = RunGains(
        columns_mm=raw * size,
        sd=size,
        price=float(np.linalg.slogdet(inner)[1]) + choice,
        coefficients=np.asarray(np.linalg.solve(inner, size * aim), dtype=np.float64),
    )
    return found, float(gained[best]) - choice

"""A hypothesis: a set of effects with fitted parameters, and the statistics by which it is judged."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.noise.run_offsets import RunOffsets
from fingervision.diagnosis.noise.whitening import Whitener
from fingervision.domain.effect import Array, Effect
from fingervision.domain.parameter import Parameter

Point = dict[str, dict[str, float]]
FORM_SHARE = 0.02
"""Typical inexactness of an effect's formula, as a share of the change that the effect causes."""
SMALL_SHARE = 0.05
"""Residual, as a share of the explained part, that is attributed to the formula of an effect rather than to another
effect: a few per cent."""


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    """A set of effects with their fitted parameters, and how well they explain a target.

    Parameters
    ----------
    names : tuple of str
        Names of the effects, in the order of the measuring chain.
    values : mapping of str to mapping of str to float
        Estimated parameters.
    score : float
        Chi-square with fitted run offsets, plus a penalty for the offsets.
    residual : ndarray of float, shape (m,)
        Whitened target minus prediction.
    covariance : ndarray of float, shape (p, p)
        Covariance of the parameters in their order; rows of parameters at a bound are zero.
    free : int
        Number of the effects' parameters that are not at a bound.
    sigma_mm : tuple of float
        Spread of the run offsets under this explanation, for each channel.
    starts_price : float
        Penalty of the fitted start states: twice the logarithm of prior width over posterior width, summed.
    places_price : float
        Penalty of the places found, beyond that of a parameter: twice the logarithm of prior width over posterior
        width, summed.
    rows : int
        Number of measured values that were not set aside.
    """

    names: tuple[str, ...]
    values: Mapping[str, Mapping[str, float]]
    score: float
    residual: Array
    covariance: Array
    free: int
    sigma_mm: tuple[float, ...]
    starts_price: float = 0.0
    places_price: float = 0.0
    rows: int = 2

    @property
    def bic(self) -> float:
        """Bayesian information criterion (Schwarz 1978), with penalties by their priors for places and start states."""
        return self.score + self.free * float(np.log(self.rows)) + self.starts_price + self.places_price


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Everything on which the score of an explanation depends: data, measuring chain, noise and run offsets.

    Parameters
    ----------
    chain : MeasuringChain
        Model and history.
    measured : ndarray of float, shape (m,)
        Whitened measurement, channels stacked.
    whitener, offsets
        The observation model.
    effects : mapping of str to Effect
        Effects that the data can show.
    form_share : float
        Ratio of the residual that the formula of an effect may leave to the explained part (amplitudes).
    stalled : frozenset of str
        Effects that readings suggest which stay constant at an end of the range.
    mapped : float
        Squared whitened length of the part that a map of position errors explains in addition to every explanation; 0
        without a map.
    random : tuple of (str, int)
        Names of the random effects beside every explanation, with their numbers of columns, in order.
    other_paths : callable
        Returns measuring chains along other paths that the log of the stage permits; none without a log.
    """

    chain: MeasuringChain
    measured: Array
    whitener: Whitener
    offsets: RunOffsets
    effects: Mapping[str, Effect]
    form_share: float = SMALL_SHARE
    stalled: frozenset[str] = frozenset()
    mapped: float = 0.0
    random: tuple[tuple[str, int], ...] = ()
    other_paths: Callable[[], Iterable[MeasuringChain]] = tuple
    _searched: dict[str, list[tuple[str, Parameter]]] = field(default_factory=dict, init=False, repr=False)

    @property
    def rows(self) -> int:
        """Number of measured values that were not set aside as gross errors, at least 2."""
        return max(2, int(self.measured.size - self.whitener.aside.sum()))

    def judged_by(self, whitener: Whitener, aim_mm: Array) -> "Problem":
        """Return the problem with another noise or other outliers; `aim_mm` of shape (m,) is the target."""
        return replace(self, whitener=whitener, measured=whitener.one(aim_mm), offsets=RunOffsets.of(whitener))

    def beside(self, columns_mm: Array) -> "Problem":
        """Return the problem with further columns of random effects, which come first; shape (m, k) (mm)."""
        return self._with_random(np.hstack([columns_mm, self.whitener.random_mm]))

    def without_first(self, count: int) -> "Problem":
        """Return the problem without the first columns of its random effects."""
        return self._with_random(self.whitener.random_mm[:, count:])

    def _with_random(self, columns_mm: Array) -> "Problem":
        return replace(self, offsets=RunOffsets.of(replace(self.whitener, drawing=columns_mm)))

    def parameters(self, names: tuple[str, ...]) -> list[tuple[str, Parameter]]:
        """Parameters of given effects, with bounds narrowed to the range that the data can show."""
        found: list[tuple[str, Parameter]] = []
        for name in names:
            if name not in self._searched:
                searched = self.effects[name].search(self.whitener.history)
                self._searched[name] = [(name, one) for one in searched if not isinstance(one, str)]
            found += self._searched[name]
        return found

    def only_run(self, column: Array, run: int | None) -> Array:
        """Keep the rows of one run in an array of shape (m,), or all rows if `run` is None."""
        if run is None or len(self.chain.history.runs) == 1:
            return column
        rows = self.chain.history.runs[run]
        n = self.chain.history.input_mm.size
        out = np.zeros_like(column)
        for begin in range(0, column.size, n):
            out[begin + rows.start : begin + rows.stop] = column[begin + rows.start : begin + rows.stop]
        return out

    def whitened(self, settings: Mapping[str, Mapping[str, float]]) -> Array:
        """Predict all channels with given parameters, and whiten the prediction; the result has shape (m,)."""
        return self.whitener.one(self.chain.stacked(settings))

    def judged(self, explanation: Explanation, values: Mapping[str, Mapping[str, float]]) -> Explanation:
        """Give an explanation other parameter values, without a refit, and the score that they have here."""
        residual = self.measured - self.whitened(values)
        sigma, penalty = self.offsets.spread(residual)
        score = self.offsets.squared(residual, self.offsets.metric(sigma)) + penalty
        return replace(explanation, values=values, score=score, residual=residual, sigma_mm=sigma)

    def cost(self, settings: Mapping[str, Mapping[str, float]]) -> float:
        """-2 log of the posterior up to a constant, marginalised over the spreads of the run offsets."""
        residual = self.measured - self.whitened(settings)
        sigma, penalty, doubt = self.offsets.spread_and_doubt(residual)
        return self.offsets.squared(residual, self.offsets.metric(sigma)) + penalty + doubt

    def nothing(self) -> Explanation:
        """The model without any effect, with its score: the explanation from which gains are counted."""
        return self.judged(Explanation((), {}, 0.0, self.measured, np.zeros((0, 0)), 0, (), rows=self.rows), {})

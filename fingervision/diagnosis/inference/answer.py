"""Assess the result of a search by the share of the disagreement that it explains."""

from dataclasses import dataclass, replace

from fingervision.diagnosis.inference.held_out_prediction import rms_mm
from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.inference.position_map import NAME
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.inference.verdict import Standing, standing
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.replicates import resolution
from fingervision.domain.effect import Array


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Result of a search, with its residual.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    found : Findings
        Findings of the search.
    before_mm, after_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted values, without and with the explanation found.
    stands : Standing
        Share of the disagreement that remains.
    """

    data: Observations
    found: Findings
    before_mm: Array
    after_mm: Array
    stands: Standing

    def values(self) -> Settings:
        """Parameters of everything that the search found: the effects, and the curve of a position map."""
        return _values(self.data, self.found)


def judged(data: Observations, found: Findings) -> Answer:
    """Compare the result with the disagreement; effects that increase the disagreement are removed from the result.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    found : Findings
        Findings of the search.
    """
    before = data.stacked_mm - data.chain.stacked({})
    after = data.stacked_mm - data.chain.stacked(_values(data, found))
    stands = standing(data, found.problem, before, after)
    digit = resolution(data.table.gap_mm) if data.recorded.commanded else 0.0
    n, edges = data.chain.history.input_mm.size, data.chain.history.both_edges
    is_larger = stands.after_mm > stands.before_mm or rms_mm(after, n, edges) > rms_mm(before, n, edges)
    if is_larger or stands.before_mm < digit:
        # Effects that increase the disagreement (outliers included) explain nothing. A disagreement below the last
        # digit of the readings is only rounding, which is constant in every hold.
        data, found = without_names(data, found, None if stands.before_mm < digit else found.unknown)
        after, stands = before, standing(data, found.problem, before, before)
    return Answer(data, found, before, after, stands)


def without_names(data: Observations, found: Findings, unknown: str | None) -> tuple[Observations, Findings]:
    """Remove all named effects from the result, including a map of position errors.

    Parameters
    ----------
    data, found
        Measurement, and findings of the search.
    unknown : str or None
        Reason why no effect is named.
    """
    nothing = replace(found, best=found.problem.nothing(), alternatives=(), unknown=unknown)
    return replace(data, position_map=None, run_gains=None), nothing


def _values(data: Observations, found: Findings) -> Settings:
    """Parameters of everything that the search found: the effects, and the curve of a position map."""
    if data.position_map is None:
        return found.best.values
    return {**found.best.values, NAME: data.position_map.values()}

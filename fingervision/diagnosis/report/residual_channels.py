"""Split a residual into its channels, and find the regions where it is more than noise."""

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Problem
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.report.residual_localization import where
from fingervision.domain.effect import Array
from fingervision.domain.report import Place


def by_channel(data: Observations, stacked: Array) -> dict[str, Array]:
    """Split a stacked residual into gap and, if they were measured, left, right and midline."""
    n = data.chain.history.input_mm.size
    gap = stacked[:n]
    out = {"gap": gap}
    if data.chain.history.both_edges:
        midline = stacked[n : 2 * n] - np.median(stacked[n : 2 * n])
        out |= {"left": midline - 0.5 * gap, "right": midline + 0.5 * gap, "midline": midline}
    if data.chain.history.force:
        out["force"] = stacked[-n:]
    return out


def places(data: Observations, problem: Problem, residual: Array, rng: np.random.Generator) -> tuple[Place, ...]:
    """Regions of the input in which the residual exceeds the noise."""
    noises = dict(zip(data.channels, problem.whitener.noises, strict=True))
    n = data.chain.history.input_mm.size
    aside = problem.whitener.aside[:n]
    return where(by_channel(data, residual), noises, data.chain.history, aside, rng)

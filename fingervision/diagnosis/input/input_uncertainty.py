"""Systematic error of the recorded input: changes of the path smaller than this error are not significant."""

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Problem

OF_ROUNDING, OF_NOISE = 0.5, 0.1
"""Shares of it that many samples do not average out: an encoder rounds alike what stands alike, noise is smoothed."""


def below_the_input(problem: Problem, size_mm: float) -> bool:
    """Whether a change of the gap is smaller than the input's remaining error or its encoder's step would cause."""
    history = problem.chain.history
    gap = problem.chain.stacked({})[: history.input_mm.size]
    slope = float(np.ptp(gap)) / history.input_span_mm
    share = OF_ROUNDING if history.input_step_mm > 0.0 else OF_NOISE
    return size_mm < share * slope * history.input_sigma_mm

"""Systematic error of the recorded input: differences in the stage's motion below this error are not significant."""

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Problem

OF_ROUNDING, OF_NOISE = 0.5, 0.1
"""Shares of the encoder's rounding error, and of the input's noise, that do not average out over many samples: equal
positions are rounded equally, whereas noise is smoothed."""


def below_the_input(problem: Problem, size_mm: float) -> bool:
    """Whether a change of the gap is smaller than the change that the input's error or its encoder step may cause."""
    history = problem.chain.history
    share = OF_ROUNDING if history.input_step_mm > 0.0 else OF_NOISE
    return size_mm < share * mean_slope(problem) * history.input_sigma_mm


def mean_slope(problem: Problem) -> float:
    """Mean change of the gap per change of the input, by the model."""
    history = problem.chain.history
    gap = problem.chain.stacked({})[: history.input_mm.size]
    return float(np.ptp(gap)) / history.input_span_mm

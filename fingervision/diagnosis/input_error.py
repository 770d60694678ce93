"""The recorded input's own error: a change below half of it is not told from it, for it is not all random noise."""

import numpy as np

from fingervision.diagnosis.explanation import Problem

SHARE = 0.5


def below_the_input(problem: Problem, size_mm: float) -> bool:
    """Whether a change of the gap is smaller than half of what the input's error, or its encoder's step, gives it."""
    history = problem.chain.history
    gap = problem.chain.stacked({})[: history.input_mm.size]
    slope = float(np.ptp(gap)) / history.input_span_mm
    return size_mm < SHARE * slope * history.input_sigma_mm

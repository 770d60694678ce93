"""An encoder's staircase: a change below half a step's own error is not told from it, for it is no random noise."""

import numpy as np

from fingervision.diagnosis.explanation import Problem

SHARE = 0.5


def below_the_staircase(problem: Problem, size_mm: float) -> bool:
    """Whether a change of the gap is smaller than half of what the steps of the input's encoder give it."""
    history = problem.chain.history
    gap = problem.chain.stacked({})[: history.input_mm.size]
    step_mm = float(np.ptp(gap)) / history.input_span_mm * history.input_step_mm / float(np.sqrt(12.0))
    return size_mm < SHARE * step_mm

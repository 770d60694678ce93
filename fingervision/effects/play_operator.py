"""The play operator: what lags behind by up to half a width, in either direction (Prandtl; Visintin 1994, III.2)."""

import numpy as np

from fingervision.domain.compiled import compiled_as_written
from fingervision.domain.effect import Array


@compiled_as_written
def play(input_mm: Array, width_mm: float, start: float) -> Array:
    """Follow one run's input with a play of full width `width_mm`; shape (n,).

    The state begins `start` half widths above the first input: -1 and 1 are the two ends of the play.
    """
    out = np.empty_like(input_mm)
    half = 0.5 * width_mm
    state = input_mm[0] + start * half
    for i in range(input_mm.size):
        state = min(max(state, input_mm[i] - half), input_mm[i] + half)
        out[i] = state
    return out

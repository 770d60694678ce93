"""The play operator: what lags behind by up to half a width, in either direction (Prandtl; Visintin 1994, III.2)."""

import numpy as np

from fingervision.domain.compiled import compiled_as_written
from fingervision.domain.effect import Array


@compiled_as_written
def play(input_mm: Array, width_mm: float) -> Array:
    """Follow one run's input with a play of full width `width_mm`, centred at the first sample; shape (n,)."""
    out = np.empty_like(input_mm)
    state = input_mm[0]
    half = 0.5 * width_mm
    for i in range(input_mm.size):
        state = min(max(state, input_mm[i] - half), input_mm[i] + half)
        out[i] = state
    return out

"""First-order low-pass of a signal that is linear between its samples: exact for any sampling."""

import numpy as np

from fingervision.domain.effect import Array
from fingervision.domain.loops import filled, loop

_low_pass = loop("low_pass_low_pass")


def low_pass(signal: Array, time_s: Array, tau_s: float, start: float) -> Array:
    """Low-pass filter one run's signal with time constant `tau_s`, from the state `start`; shape (n,)."""
    return filled(_low_pass, signal, np.ascontiguousarray(time_s), tau_s, start)

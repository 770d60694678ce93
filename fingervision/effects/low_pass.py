"""First-order low-pass of a signal that is linear between its samples: exact for any sampling."""

import numpy as np

from fingervision.domain.compiled import compiled_as_written
from fingervision.domain.effect import Array


@compiled_as_written
def low_pass(signal: Array, time_s: Array, tau_s: float, start: float) -> Array:
    """Relax one run's signal towards itself with time constant `tau_s`, from `start` at the first sample; (n,)."""
    out = np.empty_like(signal)
    out[0] = start
    for i in range(1, signal.size):
        step_s = time_s[i] - time_s[i - 1]
        lag = (signal[i] - signal[i - 1]) / step_s * tau_s
        out[i] = signal[i] - lag + (out[i - 1] - signal[i - 1] + lag) * np.exp(-step_s / tau_s)
    return out

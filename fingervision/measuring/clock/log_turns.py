"""Reversals of a logged motion, with their uncertainty."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array


def turns(input_mm: Array, least_mm: float) -> NDArray[np.intp]:
    """Indices of the extremes from which a motion returns by `least_mm` or more; shape (k,), in order."""
    values = input_mm.tolist()
    found: list[int] = []
    high = low = 0
    direction = 0
    for i, value in enumerate(values):
        if value > values[high]:
            high = i
        if value < values[low]:
            low = i
        if direction >= 0 and values[high] - value >= least_mm:
            if direction:
                found.append(high)
            direction, low = -1, i
            high = i
        elif direction <= 0 and value - values[low] >= least_mm:
            if direction:
                found.append(low)
            direction, high = 1, i
            low = i
    return np.asarray(found, dtype=np.intp)


def turned(input_mm: Array, u_mm: Array, least_mm: float) -> Array:
    """Move every reversal outwards by the RMS uncertainty of the reversals; points near it are moved by less.

    Smoothing, interpolation between rows and an encoder's rounding flatten all reversals in the same way, and the
    fitted play depends on the extreme positions. The errors of the reversals therefore do not average out, however many
    there are. Points within `least_mm` of a reversal are moved by less than the reversal itself.

    Parameters
    ----------
    input_mm, u_mm : ndarray of float, shape (n,)
        The motion and its standard uncertainty.
    least_mm : float
        Least return motion of a reversal.

    Returns
    -------
    ndarray of float, shape (n,)
    """
    out = input_mm.copy()
    at = turns(input_mm, least_mm)
    if not at.size:
        return out
    by_mm = float(np.sqrt(np.mean(u_mm[at] ** 2)))
    middles = np.concatenate([[0], (at[1:] + at[:-1]) // 2, [input_mm.size]])
    for turn, begin, end in zip(at, middles[:-1], middles[1:], strict=True):
        beyond = input_mm[begin:end] - input_mm[turn]
        sign = 1.0 if np.mean(beyond) < 0.0 else -1.0
        out[begin:end] += sign * by_mm * np.clip(1.0 - np.abs(beyond) / least_mm, 0.0, 1.0)
    return out

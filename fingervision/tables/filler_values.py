"""Numbers that a program writes where it has no value, such as -9999."""

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from fingervision.storage.number_columns import Numbers

FAR = 100.0
"""Least distance of a filler value from the median of the other values, as a multiple of their range: fillers such as
-9999 or 32767 are chosen so that no measured value comes near, and no motion jumps a hundred times its own range."""
LEAST = 900.0
"""Least size of a filler value, in the unit of the file: -999 and larger. A step from rest to rest may be a hundred
times the noise at rest, too."""
MOST_ROWS = 0.2
"""Largest fraction of a column's rows that may hold the filler value."""


def filler_value(values: Numbers) -> float | None:
    """Find the number that probably means no value; None if there is none.

    Parameters
    ----------
    values : Numbers
        A column of numbers, in the unit of the file.

    Examples
    --------
    >>> filler_value(Numbers.whole(np.array([0.6, 0.7, 0.8, -9999.0, 0.9, 1.0])))
    -9999.0
    >>> filler_value(Numbers.whole(np.array([0.6, 0.7, 0.8, 5.0, 0.9, 1.0]))) is None
    True
    """
    known = values.value[values.present]
    if known.size < 2:
        return None
    middle = float(np.median(known))
    furthest = float(known[int(np.argmax(np.abs(known - middle)))])
    others = known[known != furthest]
    if not others.size or known.size - others.size > MOST_ROWS * known.size:
        return None
    spread = float(np.ptp(others))
    is_far = abs(furthest) >= LEAST and abs(furthest - middle) > FAR * spread > 0.0
    return furthest if is_far else None


def dropped_out(values: Numbers) -> NDArray[np.bool_]:
    """Rows in which a column leaps to exactly zero and back, which no motion does: a drop-out.

    A leap is larger than twice the largest step between other rows; a stage that rests at zero arrives there by steps
    of the usual size. In a column with such leaps, zeros that last no longer are drop-outs too, unless the steps beside
    them become small: to lose a row does less harm than a wrong one.
    Zeros in more than `MOST_ROWS` of the rows are a state and no drop-outs.

    Examples
    --------
    >>> dropped_out(Numbers.whole(np.array([0.0, 0.1, 0.2, 0.3, 0.0, 0.3, 0.2, 0.1, 0.0]))).nonzero()[0]
    array([4])
    """
    known = np.flatnonzero(values.present)
    number = values.value[known]
    out = np.zeros(values.value.size, dtype=np.bool_)
    rest, zeros = np.flatnonzero(number != 0.0), np.flatnonzero(number == 0.0)
    if rest.size < 2 or not zeros.size:
        return out
    steps = np.abs(np.diff(number[rest]))
    usual = float(np.max(steps[np.diff(rest) == 1], initial=0.0))
    # `lengths[k]` zeros stand before row k of those that are not zero; the last, behind all of them.
    lengths = np.diff(np.concatenate([[-1], rest, [number.size]])) - 1
    inner = np.flatnonzero(lengths[1:-1]) + 1
    before, after = np.abs(number[rest[inner - 1]]), np.abs(number[rest[inner]])
    leaps = np.minimum(before, after) > 2.0 * usual
    if usual == 0.0 or not leaps.any():
        return out
    padded = np.concatenate([[0.0], steps, [0.0]])
    near = np.maximum(padded[inner - 1], padded[inner + 1])
    off = (before + after > near) & (lengths[inner] <= np.max(lengths[inner[leaps]]))
    ends = np.array([0, rest.size])[np.abs(number[rest[[0, -1]]]) > 2.0 * usual]
    dropped = zeros[np.isin(np.searchsorted(rest, zeros), np.concatenate([inner[leaps | off], ends]))]
    out[known[dropped]] = dropped.size <= MOST_ROWS * number.size
    return out


def without_filler(values: Numbers, stated: str) -> Numbers:
    """Mark the number that the user states as the filler value as missing; of zeros, only those that drop out."""
    try:
        filler = float(stated)
    except ValueError:
        return values
    if not isfinite(filler):
        return values
    held = dropped_out(values) if filler == 0.0 else values.value == filler
    return Numbers(np.where(held, 0.0, values.value), values.present & ~held)

"""Numbers that a program writes where it has no value, such as -9999."""

from math import isfinite

import numpy as np

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


def without_filler(values: Numbers, stated: str) -> Numbers:
    """Mark the number that the user states as the filler value as missing."""
    try:
        filler = float(stated)
    except ValueError:
        return values
    if not isfinite(filler):
        return values
    held = values.value == filler
    return Numbers(np.where(held, 0.0, values.value), values.present & ~held)

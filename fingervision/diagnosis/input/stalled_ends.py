"""Ends of the range at which the reading stays constant while the command continues, because of a stop or contact."""

import numpy as np

from fingervision.diagnosis.noise.replicates import resolution
from fingervision.domain.effect import Array
from fingervision.effects import catalogue

FEWEST_EQUAL = 6
"""Least number of equal readings at an end that does not occur by chance."""
LONGER = 3.0
"""Ratio to the longest constant stretch elsewhere, in rows and in predicted motion, because the steps of a dead band
are constant too."""
LEAST_DIGITS = 5.0
"""Digits of the reading by which the model must move while the reading is constant."""


def stalled_ends(input_mm: Array, predicted_mm: Array, gap_mm: Array) -> frozenset[str]:
    """Effects that would explain a constant reading at an end of the range.

    Noise changes a reading from row to row; readings that are equal over many rows, while the model moves by many
    digits, have another cause.

    Parameters
    ----------
    input_mm, predicted_mm, gap_mm : ndarray of float, shape (n,)
        Recorded input, predicted and measured gap.
    """
    order = np.argsort(input_mm, kind="stable")
    gap, predicted = gap_mm[order], predicted_mm[order]
    digit = resolution(gap_mm)
    changes = np.flatnonzero(np.abs(np.diff(gap)) > 0.5 * digit) + 1
    borders = np.concatenate([[0], changes, [gap.size]])
    rows = np.diff(borders)
    motion = np.maximum.reduceat(predicted, borders[:-1]) - np.minimum.reduceat(predicted, borders[:-1])
    found: frozenset[str] = frozenset()
    for end, word in ((0, "closed"), (rows.size - 1, "open")):
        others = np.arange(rows.size) != end
        least = max(float(FEWEST_EQUAL), LONGER * float(rows[others].max(initial=0)))
        far = max(LEAST_DIGITS * digit, LONGER * float(motion[others].max(initial=0.0)))
        if rows.size > 1 and rows[end] >= least and motion[end] > far:
            found |= {name for name, effect in catalogue().items() if word in effect.stands_at}
    return found

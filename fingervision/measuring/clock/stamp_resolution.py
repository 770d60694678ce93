"""Resolution of a log's time stamps, recognised from the times between its rows."""

import numpy as np

from fingervision.domain.effect import Array

LEAST_S = 1e-4
"""Resolution (s) below which rounded times do not matter: a tenth of the offset's least standard uncertainty."""
MOST_KINDS = 12
"""Most different times between rows of a log with a regular cycle; more indicate times that are not rounded."""
SAME = 0.02
"""Deviation from a multiple of the resolution, as a share of it, that the digits of the file explain."""
MISSING_ROWS = 0.7
"""Share of the shortest time between rows, if it is the resolution itself, above which the longer ones come from
missing rows, not from rounding."""


def stamp_resolution_s(time_s: Array) -> float:
    """Resolution of the times (s), if they are visibly rounded: a cycle of 50 ms on a clock of 15.6 ms; else 0.

    Examples
    --------
    >>> round(stamp_resolution_s(np.floor(np.arange(0.0, 9.0, 0.05) / 0.0156) * 0.0156), 6)
    0.0156
    >>> missing_row = np.array([0.0, 0.1, 0.2, 0.4, 0.5, 0.6, 0.7])
    >>> stamp_resolution_s(np.arange(0.0, 9.0, 0.05)), stamp_resolution_s(missing_row)
    (0.0, 0.0)
    """
    steps = np.sort(np.diff(time_s))
    if steps.size < 2 or steps[0] <= 0.0:
        return 0.0
    jumps = np.flatnonzero(np.diff(steps) > 0.5 * LEAST_S)
    if not 1 <= jumps.size < MOST_KINDS:
        return 0.0
    kinds = np.array([np.median(part) for part in np.split(steps, jumps + 1)])
    resolution = float(np.min(np.diff(kinds)))
    multiples = kinds / resolution
    if resolution < LEAST_S or np.any(np.abs(multiples - np.round(multiples)) > SAME * np.sqrt(multiples)):
        return 0.0
    shortest = (jumps[0] + 1) / steps.size
    is_missing_rows = round(multiples[0]) == 1 and (kinds.size > 2 or shortest > MISSING_ROWS)
    return 0.0 if is_missing_rows else resolution

"""Unit that a question suggests for a column without a unit, from the size of its numbers."""

import numpy as np
from numpy.typing import NDArray

from fingervision.tables.doubts import GREATEST_INPUT_MM, LEAST_INPUT_MM
from fingervision.tables.times import counts_days, is_epoch

LONGEST_STEP_S = 2.0
"""Time between rows (s) beyond which a number of milliseconds is more probable: logs of stages have 5 to 1000 rows per
second."""


def likely_unit(dimension: str, values: NDArray[np.float64]) -> str:
    """Suggest a unit of length, time or force. The user decides; the suggestion is often copied unread.

    Examples
    --------
    >>> likely_unit("length", np.array([0.0, 1.2])), likely_unit("length", np.array([0.0, 1200.0]))
    ('mm', 'um')
    >>> likely_unit("time", np.arange(5.0)), likely_unit("time", 20.0 * np.arange(5.0))
    ('s', 'ms')
    """
    if dimension == "force":
        return "N"
    if values.size < 2:
        return "mm" if dimension == "length" else "s"
    if dimension == "length":
        travel = float(np.ptp(values))
        if 0.0 < travel < LEAST_INPUT_MM:
            return "m"
        return "mm" if travel <= GREATEST_INPUT_MM else "um" if travel <= 1e3 * GREATEST_INPUT_MM else "nm"
    if counts_days(values):
        return "d"
    units = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
    for unit, size in units.items():
        if is_epoch(float(values[0]) / size):
            return unit
    step = float(np.median(np.abs(np.diff(values))))
    return next((unit for unit, size in units.items() if step <= LONGEST_STEP_S * size), "ns")

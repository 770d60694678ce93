"""Units that the numbers of a column without a known unit may have, each with the values that it gives."""

import re

import numpy as np
from numpy.typing import NDArray

from fingervision.tables.doubts import GREATEST_INPUT_MM, LEAST_INPUT_MM
from fingervision.tables.questions import Question, Reading, asked, span
from fingervision.tables.times import counts_days, is_epoch
from fingervision.tables.units import CANONICAL, factor, known_unit, written_multiple

UNITS = {
    "length": ("mm", "um", "m", "in", "nm", "cm"),
    "time": ("s", "ms", "us", "ns", "min", "h", "d"),
    "force": ("N", "mN", "kN"),
}
"""Units that are offered, the most usual first."""
TIME_STEPS_S = (2e-6, 2.0)
"""Time between rows (s) that is plausible: logs of stages have 5 to 1000 rows per second."""
FEWEST_COUNTS = 100
"""Range of whole numbers above which they may be an encoder's counts, whose size only the user knows."""
TIMES_TEN = re.compile(r"[x\u00d7*\u00b7]\s*(.+)")
"""A unit with a multiplication sign before it: `x10 um` may mean tens of micrometres, or numbers times ten."""


def unit_question(words: str, role: str, dimension: str, values: NDArray[np.float64]) -> Question:
    """Question for the unit of a column; each unit with which the numbers are plausible is a reading.

    Examples
    --------
    >>> unit_question("?", "gap", "length", np.array([0.0, 1.2])).key
    'units.gap=mm'
    >>> [each.key for each in unit_question("?", "gap", "length", np.array([0.0, 1200.0])).readings]
    ['units.gap=um', 'units.gap=SIZE um']
    >>> [each.key for each in unit_question("?", "gap", "length", np.array([0.5, 1200.0])).readings]
    ['units.gap=um']
    >>> unit_question("?", "time", "time", 20.0 * np.arange(5.0)).key
    'units.time=ms'
    """
    units = [unit for unit in UNITS[dimension] if _is_plausible(dimension, unit, values)] or [UNITS[dimension][0]]
    if dimension == "time" and counts_days(values):
        units = ["d"]
    readings = unit_readings(role, dimension, units, values)
    if dimension == "length" and values.size and np.ptp(values) >= FEWEST_COUNTS and np.all(values == np.rint(values)):
        readings.append(Reading(f"units.{role}=SIZE um", "counts, each worth SIZE um"))
    return asked(words, readings)


def unit_readings(role: str, dimension: str, units: list[str], values: NDArray[np.float64]) -> list[Reading]:
    """The readings of a column in each of several units; times are counted from the first."""
    if dimension == "time" and values.size:
        values = values - values[0]
    return [
        Reading(f"units.{role}={unit}", span(values * (factor(unit, dimension) or 1.0), CANONICAL[dimension]))
        for unit in units
    ]


def _is_plausible(dimension: str, unit: str, values: NDArray[np.float64]) -> bool:
    size = factor(unit, dimension)
    if size is None or values.size < 2:
        return unit == UNITS[dimension][0]
    if dimension == "length":
        return LEAST_INPUT_MM <= size * float(np.ptp(values)) <= GREATEST_INPUT_MM
    if dimension == "time":
        step = size * float(np.median(np.abs(np.diff(values))))
        return bool(is_epoch(size * float(values[0]))) or TIME_STEPS_S[0] <= step <= TIME_STEPS_S[1]
    return True


def wrong_unit(name: str, role: str, dimension: str, unit: str, values: NDArray[np.float64]) -> Question:
    """Question for a column whose stated unit is unknown or of another dimension."""
    words = f"'{name}' ({role}) must be a {dimension}, but its unit is '{unit}'"
    # A micro sign that was lost on the way is often a question mark.
    micro = known_unit(unit.replace("?", "µ").replace("\N{REPLACEMENT CHARACTER}", "µ"))
    if micro:
        return asked(words, unit_readings(role, dimension, [micro], values))
    times = TIMES_TEN.fullmatch(unit)
    if times is not None and factor(times[1], dimension) is not None:
        size, one = written_multiple(times[1])
        units = [f"{size:g} {one}", f"{1.0 / size:g} {one}"]
        return asked(f"{words}, which may have two meanings", unit_readings(role, dimension, units, values))
    example = {"length": "SIZE um", "time": "SIZE ms", "force": "SIZE mN"}[dimension]
    return Question(
        f"{words}: state what one unit is worth, with a number for SIZE, or another column as columns.{role}",
        f"units.{role}={example}",
    )

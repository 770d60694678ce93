"""Quantities of positioning accuracy: symbols and definitions of ISO 230-2:2014, and their data classes.

The arrows of ISO 230-2 are written `up` (target approached from below, the input increasing) and `down` (from above).

References
----------
.. [1] ISO 230-2:2014, Test code for machine tools, Part 2: Determination of accuracy and repeatability of positioning
   of numerically controlled axes, clause 3 (definitions).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from scipy.special import stdtrit

UP, DOWN = 1, -1
"""Directions of approach, as signs of the motion."""
COVERAGE = 2.0
"""Coverage factor of ISO 230-2: standard deviations on each side of a mean (R_up = 4 s)."""
FEWEST_TARGETS = 5
"""Number of targets that ISO 230-2 requires on a linear axis up to 2 m; with fewer, the quantities are computed with a
remark."""
FEWEST_CYCLES = 5
"""Number of approaches of each target from each side that ISO 230-2 requires (clause 5.3.2); with fewer, the quantities
are computed with a remark."""

_U, _D = "approached from below", "approached from above"
DEFINITIONS: Mapping[str, str] = {
    "B_mean": f"mean over the targets of the reversal B_i = mean deviation {_U} minus mean deviation {_D}",
    "B": "reversal of the axis: the largest absolute reversal |B_i| of a target",
    "R_up": f"repeatability from below: 4 times the largest standard deviation s_i of a target's readings, {_U}",
    "R_down": f"repeatability from above: 4 times the largest standard deviation s_i of a target's readings, {_D}",
    "R": "bidirectional repeatability: the largest of 2 s_up + 2 s_down + |B_i|, 4 s_up and 4 s_down of any target",
    "E_up": f"systematic deviation from below: range over the targets of the mean deviation, {_U}",
    "E_down": f"systematic deviation from above: range over the targets of the mean deviation, {_D}",
    "E": "bidirectional systematic deviation: range of all mean deviations, over the targets and both directions",
    "M": "mean bidirectional deviation: range over the targets of the mean of both directions' mean deviations",
    "A_up": f"accuracy from below: range over the targets of mean deviation +- 2 s_i, {_U}",
    "A_down": f"accuracy from above: range over the targets of mean deviation +- 2 s_i, {_D}",
    "A": "bidirectional accuracy: range of mean deviation +- 2 s_i, over the targets and both directions",
}
"""Symbol and definition of every quantity, in the order of the report."""


@dataclass(frozen=True, slots=True)
class Visits:
    """Readings at one target from one side: number, mean deviation, standard deviation (None for one reading)."""

    n: int
    mean_mm: float
    s_mm: float | None


@dataclass(frozen=True, slots=True)
class Target:
    """A target with its readings from either side.

    The reversal of target i is B_i, the mean deviation approached from below minus that from above (up - down).
    """

    target_mm: float
    up: Visits | None
    down: Visits | None
    reversal_mm: float | None
    u_reversal_mm: float | None
    degrees_of_freedom: int | None = None


@dataclass(frozen=True, slots=True)
class Figure:
    """A quantity of the axis: value with standard uncertainty if known, or the reason why there is no value.

    With five cycles an uncertainty has four degrees of freedom: a 95 % interval extends by 2.8 times the uncertainty to
    either side, instead of twice the uncertainty.
    """

    symbol: str
    definition: str
    value_mm: float | None
    u_mm: float | None = None
    degrees_of_freedom: int | None = None
    reason: str | None = None

    @property
    def interval_mm(self) -> float | None:
        """Half of a 95 % interval (Student's t) in mm; None where the uncertainty is unknown."""
        if self.u_mm is None or self.degrees_of_freedom is None:
            return None
        return float(stdtrit(self.degrees_of_freedom, 0.975)) * self.u_mm


@dataclass(frozen=True, slots=True)
class PositioningAccuracy:
    """All quantities of an axis by symbol, the targets from which they are computed, and remarks."""

    targets: tuple[Target, ...]
    figures: Mapping[str, Figure]
    notes: tuple[str, ...]

    def value_mm(self, symbol: str) -> float:
        """Value of a quantity that exists (mm); requesting one without a value is a programming error."""
        value = self.figures[symbol].value_mm
        if value is None:
            message = f"{symbol} has no value: {self.figures[symbol].reason}."
            raise ValueError(message)
        return value

"""Positioning accuracy and repeatability of an axis from repeated visits of targets, as ISO 230-2:2014 defines them.

Published reports deviate from ISO 230-2 in three ways, which the tests check with readings of real stages. In a report,
`forward` may mean the approach from above, so that the reversal has the opposite sign. The stated repeatability R may
be max(R_up, R_down), whereas the R of ISO 230-2 is bidirectional and includes the reversal. The stated accuracy E may
be the accuracy in one direction only. The functions of this module compute all quantities of ISO 230-2: compare a
published R with R_up and R_down, and a published E with E_up and E_down.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtrit

# Quantities of positioning accuracy: symbols and definitions of ISO 230-2:2014, and their data classes.


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


Array = NDArray[np.float64]
Integers = NDArray[np.intp]


def positioning_accuracy(
    target_mm: ArrayLike, deviation_mm: ArrayLike, direction: ArrayLike, cycle: ArrayLike
) -> PositioningAccuracy:
    """Compute reversal, repeatability, systematic deviation and accuracy of an axis.

    Parameters
    ----------
    target_mm : ndarray of float, shape (n,)
        Target of each reading; all readings of a target must have exactly the same number.
    deviation_mm : ndarray of float, shape (n,)
        Measured position minus target (or measured minus simulated gap).
    direction : ndarray of int, shape (n,)
        +1 for an approach from below, -1 from above, 0 if unknown (such readings are left out).
    cycle : ndarray of int, shape (n,)
        Number of the visit of that target from that side; the readings of one visit are averaged first. The reversal's
        uncertainty is computed from the differences of visits with equal numbers, so that a drift from cycle to cycle
        does not enlarge it.

    Returns
    -------
    PositioningAccuracy
        Bidirectional quantities over the targets approached from both sides, the others over all targets of that side;
        R and A over those with at least two visits.

    Raises
    ------
    ValueError
        If the arrays differ in length, numbers are not finite, or directions are other than +1, -1 and 0.

    Examples
    --------
    >>> found = positioning_accuracy([0, 1, 1, 0], [0.0, 0.1, 0.4, 0.2], [1, 1, -1, -1], [0, 0, 0, 0])
    >>> round(found.value_mm("B_mean"), 3), round(found.value_mm("E"), 3)
    (-0.25, 0.4)
    """
    places, deviations, sides, numbers = _checked(target_mm, deviation_mm, direction, cycle)
    targets: list[Target] = []
    by_cycle: dict[int, list[float]] = {}
    for place in np.unique(places[sides != 0]):
        at = places == place
        up, down = (_by_visit(deviations, numbers, at & (sides == side)) for side in (UP, DOWN))
        targets.append(_target(float(place), up, down))
        for visit in up.keys() & down.keys():
            by_cycle.setdefault(visit, []).append(up[visit] - down[visit])
    below = [_side([t.up for t in targets], "below")]
    above = [_side([t.down for t in targets], "above")]
    pairs = [t for t in targets if t.up is not None and t.down is not None]
    both = [_side([t.up for t in pairs], "both sides"), _side([t.down for t in pairs], "both sides")]
    paired = all(len(one) == len(pairs) for one in by_cycle.values())
    found = _reversals(targets, list(by_cycle.values()) if paired else [])
    for symbol, sides_of in (("_up", below), ("_down", above), ("", both)):
        found |= {
            f"R{symbol}": _figure(f"R{symbol}", sides_of, _repeatability, fewest=1, scatter=True),
            f"E{symbol}": _figure(f"E{symbol}", sides_of, _systematic),
            f"A{symbol}": _figure(f"A{symbol}", sides_of, _accuracy, scatter=True),
        }
    found["M"] = _figure("M", both, _mean_bidirectional)
    figures = {symbol: found[symbol] for symbol in DEFINITIONS}
    return PositioningAccuracy(tuple(targets), figures, _notes(targets))


@dataclass(frozen=True, slots=True)
class _Side:
    """Means and standard deviations of the targets approached from one side; s is 0 where `scattered` is False."""

    mean: Array
    s: Array
    scattered: NDArray[np.bool_]
    words: str


def _checked(*given: ArrayLike) -> tuple[Array, Array, Integers, Integers]:
    """Check four columns: equal lengths, the first two with finite numbers, and known directions of approach."""
    target, deviation, side, number = (np.atleast_1d(np.asarray(column, dtype=np.float64)) for column in given)
    names = ("target_mm", "deviation_mm", "direction", "cycle")
    for name, column in zip(names, (target, deviation, side, number), strict=True):
        if column.shape != (target.size,):
            message = f"{name} must have {target.size} values, one a reading, but has shape {column.shape}."
            raise ValueError(message)
        if not np.all(np.isfinite(column)):
            message = f"{name} must be finite, but is {column[~np.isfinite(column)][0]}: leave that reading out."
            raise ValueError(message)
    strange = side[~np.isin(side, (UP, 0, DOWN))]
    if strange.size:
        message = f"direction must be +1 (from below), -1 (from above) or 0 (not known), but is {strange[0]:g}."
        raise ValueError(message)
    return target, deviation, side.astype(np.intp), number.astype(np.intp)


def _by_visit(deviation: Array, number: Integers, chosen: NDArray[np.bool_]) -> dict[int, float]:
    """Mean deviation of each visit of a target, over the selected readings."""
    return {int(visit): float(np.mean(deviation[chosen & (number == visit)])) for visit in np.unique(number[chosen])}


def _visits(readings: dict[int, float]) -> Visits | None:
    if not readings:
        return None
    values = np.array(list(readings.values()))
    return Visits(values.size, float(values.mean()), float(values.std(ddof=1)) if values.size > 1 else None)


def _target(place: float, up: dict[int, float], down: dict[int, float]) -> Target:
    """Statistics of a target; the uncertainty of the reversal is from paired visits, or else from both scatters."""
    above, below = _visits(down), _visits(up)
    if above is None or below is None:
        return Target(place, below, above, None, None)
    paired = np.array([up[visit] - down[visit] for visit in up.keys() & down.keys()])
    u, freedom = None, None
    if paired.size > 1:
        u, freedom = float(paired.std(ddof=1) / np.sqrt(paired.size)), paired.size - 1
    elif above.s_mm is not None and below.s_mm is not None:
        u = float(np.hypot(below.s_mm / np.sqrt(below.n), above.s_mm / np.sqrt(above.n)))
        # The smaller of the two degrees of freedom is a safe bound of Welch and Satterthwaite's formula.
        freedom = min(below.n, above.n) - 1
    return Target(place, below, above, below.mean_mm - above.mean_mm, u, freedom)


def _side(visits: Sequence[Visits | None], words: str) -> _Side:
    of = [v for v in visits if v is not None]
    scattered = np.array([v.s_mm is not None for v in of], dtype=bool)
    return _Side(np.array([v.mean_mm for v in of]), np.array([v.s_mm or 0.0 for v in of]), scattered, words)


def _repeatability(sides: Sequence[_Side]) -> float:
    """Repeatability R of the targets: 4 s for one side; with two sides the reversal is included."""
    single = max(float(2.0 * COVERAGE * np.max(side.s)) for side in sides)
    if len(sides) == 1:
        return single
    up, down = sides
    return max(single, float(np.max(COVERAGE * (up.s + down.s) + np.abs(up.mean - down.mean))))


def _systematic(sides: Sequence[_Side]) -> float:
    return float(np.ptp(np.concatenate([side.mean for side in sides])))


def _mean_bidirectional(sides: Sequence[_Side]) -> float:
    return float(np.ptp(np.mean([side.mean for side in sides], axis=0)))


def _accuracy(sides: Sequence[_Side]) -> float:
    high, low = (np.concatenate([one.mean + sign * COVERAGE * one.s for one in sides]) for sign in (1.0, -1.0))
    return float(high.max() - low.min())


Statistic = Callable[[Sequence[_Side]], float]


def _figure(
    symbol: str,
    sides: Sequence[_Side],
    of: Callable[[Sequence[_Side]], float],
    *,
    fewest: int = 2,
    scatter: bool = False,
) -> Figure:
    """Compute a quantity over the targets with sufficient readings, or state why there are too few readings."""
    words, targets = sides[0].words, sides[0].mean.size
    if scatter:
        kept = np.logical_and.reduce([side.scattered for side in sides])
        sides = [_Side(side.mean[kept], side.s[kept], side.scattered[kept], words) for side in sides]
    left = sides[0].mean.size
    reason = None
    if not targets:
        reason = f"no target was approached from {words}"
    elif not left:
        reason = f"no target was visited twice from {words}, so the scatter of its readings is not known"
    elif left < fewest:
        reason = f"a range over the targets needs {fewest} that were approached from {words}, but there is {left}"
    value = of(sides) if reason is None else None
    return Figure(symbol, DEFINITIONS[symbol], value, reason=reason)


def _reversals(targets: Sequence[Target], by_cycle: Sequence[Sequence[float]]) -> dict[str, Figure]:
    """Reversal B and its mean, whose uncertainty is from the scatter of the cycles' means if there are two or more."""
    known = [t for t in targets if t.reversal_mm is not None]
    if not known:
        reason = "no target was approached from both sides"
        return {symbol: Figure(symbol, DEFINITIONS[symbol], None, reason=reason) for symbol in ("B_mean", "B")}
    reversals = np.array([t.reversal_mm for t in known])
    worst = int(np.argmax(np.abs(reversals)))
    u_mean, freedom = None, None
    if len(by_cycle) > 1:
        means = np.array([np.mean(one) for one in by_cycle])
        u_mean, freedom = float(means.std(ddof=1) / np.sqrt(means.size)), means.size - 1
    elif all(t.u_reversal_mm is not None for t in known):
        u_mean = float(np.sqrt(sum((t.u_reversal_mm or 0.0) ** 2 for t in known)) / len(known))
        freedom = min(t.degrees_of_freedom or 0 for t in known)
    largest, at = float(np.abs(reversals[worst])), known[worst]
    return {
        "B_mean": Figure("B_mean", DEFINITIONS["B_mean"], float(reversals.mean()), u_mean, freedom),
        "B": Figure("B", DEFINITIONS["B"], largest, at.u_reversal_mm, at.degrees_of_freedom),
    }


def _notes(targets: Sequence[Target]) -> tuple[str, ...]:
    """Remarks on the quantities: fewer targets or cycles than the standard requires, or one side missing."""
    notes = []
    if len(targets) < FEWEST_TARGETS:
        notes.append(f"ISO 230-2 asks for at least {FEWEST_TARGETS} targets; there are {len(targets)}.")
    fewest = min((v.n for t in targets for v in (t.up, t.down) if v is not None), default=0)
    if fewest < FEWEST_CYCLES:
        notes.append(
            f"ISO 230-2 asks for {FEWEST_CYCLES} approaches of a target from each side; the fewest here are {fewest}."
        )
    single = [t.target_mm for t in targets if t.up is None or t.down is None]
    if single:
        places = ", ".join(f"{place:g}" for place in single[:8]) + (" and others" if len(single) > 8 else "")
        notes.append(
            f"Approached from one side only, and therefore not included in the bidirectional values: {places} mm."
        )
    return tuple(notes)

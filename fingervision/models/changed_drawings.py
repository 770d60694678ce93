"""Figures of changed drawings: bars alone answer them, and change the model's own figures in that ratio.

A finger that is meshed takes half a second, bars a few milliseconds. Where a figure is no finite number of one sign, or
bars have it off by more than half, it is the bars' own.
"""

from collections.abc import Callable, Mapping
from math import isfinite

Figures = Mapping[str, float | None]

_MOST = 2.0
"""Either way: a figure that differs so much is near zero or another thing, such as the place of a peak."""


def ratios(own: Figures, bars: Figures) -> dict[str, float]:
    """Return the model's own figures of the drawing over those of bars alone; 1 where there is no such ratio."""
    return {name: _ratio(own[name], value) for name, value in bars.items()}


def _ratio(own: float | None, bars: float | None) -> float:
    if own is None or bars is None or not isfinite(own) or not isfinite(bars) or bars == 0.0:
        return 1.0
    ratio = own / bars
    return ratio if 1.0 / _MOST < ratio < _MOST else 1.0


def scaled(figures: Figures, by: Mapping[str, float]) -> dict[str, float | None]:
    """Change figures in these ratios."""
    return {name: None if value is None else by.get(name, 1.0) * value for name, value in figures.items()}


def in_ratio(bars: Callable[[Mapping[str, float]], Figures], own: Figures) -> Callable[[Mapping[str, float]], Figures]:
    """Make figures of changed drawings out of those of bars.

    Parameters
    ----------
    bars : callable
        Changes of some numbers to figures by bars alone.
    own : mapping of str to float or None
        The model's own, of the drawing as it is.
    """
    by = ratios(own, bars({}))
    return lambda changes: scaled(bars(changes), by)

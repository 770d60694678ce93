"""Figures of changed drawings: a bar model computes the ratio by which the model's own figures change.

A meshed finger takes half a second, bars take a few milliseconds. If a figure is not finite or changes sign, or the bar
model is wrong by more than half, the bar model's own figure is used.
"""

from collections.abc import Callable, Mapping
from math import isfinite

Figures = Mapping[str, float | None]

_MOST = 2.0
"""Either way: a figure that differs so much is near zero or another thing, such as the place of a peak."""


def ratios(own: Figures, bars: Figures) -> dict[str, float]:
    """Ratio of the model's own figures to those of the bar model, for the drawing; 1 where there is no ratio."""
    return {name: _ratio(own[name], value) for name, value in bars.items()}


def _ratio(own: float | None, bars: float | None) -> float:
    if own is None or bars is None or not isfinite(own) or not isfinite(bars) or bars == 0.0:
        return 1.0
    ratio = own / bars
    return ratio if 1.0 / _MOST < ratio < _MOST else 1.0


def scaled(figures: Figures, by: Mapping[str, float]) -> dict[str, float | None]:
    """Multiply figures by these ratios."""
    return {name: None if value is None else by.get(name, 1.0) * value for name, value in figures.items()}


def in_ratio(bars: Callable[[Mapping[str, float]], Figures], own: Figures) -> Callable[[Mapping[str, float]], Figures]:
    """Compute figures of changed drawings from those of the bar model.

    Parameters
    ----------
    bars : callable
        Changes of some numbers to figures by bars alone.
    own : mapping of str to float or None
        The model's own, of the drawing as it is.
    """
    by = ratios(own, bars({}))
    return lambda changes: scaled(bars(changes), by)

"""Approximate a model's figures for drawings with changed dimensions, from the faster bar model.

Each figure of the bar model is multiplied by a ratio: the figure of the accurate model over the figure of the bar
model, for the unchanged drawing. A model with a meshed finger takes half a second to compute, a bar model a few
milliseconds. If a figure is not finite, or the ratio is not between 1/2 and 2, the bar model's figure is used without a
ratio.
"""

from collections.abc import Callable, Mapping
from math import isfinite

Figures = Mapping[str, float | None]

_MOST = 2.0
"""Largest ratio of two figures, or of their inverses, that is used: figures that differ by more are near zero or
describe different things, such as a stress peak at another place."""


def ratios(own: Figures, bars: Figures) -> dict[str, float]:
    """Ratio of each figure of the model to the bar model's figure, for the unchanged drawing; 1 where not usable."""
    return {name: _ratio(own[name], value) for name, value in bars.items()}


def _ratio(own: float | None, bars: float | None) -> float:
    if own is None or bars is None or not isfinite(own) or not isfinite(bars) or bars == 0.0:
        return 1.0
    ratio = own / bars
    return ratio if 1.0 / _MOST < ratio < _MOST else 1.0


def scaled(figures: Figures, by: Mapping[str, float]) -> dict[str, float | None]:
    """Multiply figures by the ratios of the same names; a figure without a ratio is not changed."""
    return {name: None if value is None else by.get(name, 1.0) * value for name, value in figures.items()}


def in_ratio(bars: Callable[[Mapping[str, float]], Figures], own: Figures) -> Callable[[Mapping[str, float]], Figures]:
    """Return a function that estimates the figures of changed drawings: the bar model's figures times fixed ratios.

    Parameters
    ----------
    bars : callable
        Maps changes of dimensions to the figures of the bar model.
    own : mapping of str to float or None
        Figures of the accurate model for the unchanged drawing.
    """
    by = ratios(own, bars({}))
    return lambda changes: scaled(bars(changes), by)

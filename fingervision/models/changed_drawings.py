"""Approximate the numerical results of a model for drawings with changed dimensions, from the faster bar model.

Each result of the bar model is multiplied by a ratio: the result of the accurate model over that of the bar model, for
the unchanged drawing. A model with a meshed finger takes half a second to compute, a bar model a few milliseconds. If a
result is not finite, or the ratio is not between 1/2 and 2, the result of the bar model is used without a ratio.
"""

from collections.abc import Callable, Mapping
from math import isfinite

Figures = Mapping[str, float | None]

_MOST = 2.0
"""Largest ratio of two results, or of their inverses, that is used: results that differ by more are near zero or
describe different quantities, such as a stress peak at another place."""


def ratios(own: Figures, bars: Figures) -> dict[str, float]:
    """Ratio of each result of the model to that of the bar model, for the unchanged drawing; 1 if it cannot be used."""
    return {name: _ratio(own[name], value) for name, value in bars.items()}


def _ratio(own: float | None, bars: float | None) -> float:
    if own is None or bars is None or not isfinite(own) or not isfinite(bars) or bars == 0.0:
        return 1.0
    ratio = own / bars
    return ratio if 1.0 / _MOST < ratio < _MOST else 1.0


def scaled(figures: Figures, by: Mapping[str, float]) -> dict[str, float | None]:
    """Multiply results by the ratios of the same names; a result without a ratio is not changed."""
    return {name: None if value is None else by.get(name, 1.0) * value for name, value in figures.items()}


def in_ratio(bars: Callable[[Mapping[str, float]], Figures], own: Figures) -> Callable[[Mapping[str, float]], Figures]:
    """Return a function that estimates results for changed drawings: the results of the bar model times fixed ratios.

    Parameters
    ----------
    bars : callable
        Maps changes of dimensions to the results of the bar model.
    own : mapping of str to float or None
        Results of the accurate model for the unchanged drawing.
    """
    by = ratios(own, bars({}))
    return lambda changes: scaled(bars(changes), by)

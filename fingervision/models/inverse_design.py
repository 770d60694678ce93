"""Inverse design: the dimensions of a drawing for which its figures take wanted values.

The lumped model is solved for the dimensions, and its targets are corrected until finite elements of the drawing meet
the wanted values themselves (space mapping: Bandler et al., 1994, IEEE Transactions on Microwave Theory and Techniques
42, 2536, doi:10.1109/22.339794).
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fingervision.domain.errors import FingervisionError, ModelError, UsageError

Array = NDArray[np.float64]
Figures = Callable[[Mapping[str, float]], Mapping[str, float]]

_MET = 5e-4
"""Relative difference from the wanted value at which it counts as met: half of the tenth of a percent that is promised,
the rest for the mesh."""
_ROUNDS = 6
_STEP = 0.01
"""Step of the derivatives, as a share of the range of a dimension: meshes of neighbouring drawings differ by chance,
which changes the lumped model's figures by up to 1e-5."""
_WITHIN = 2.0
"""Range of a dimension without stated bounds: from the drawn value over this factor to the value times it."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """A dimension to be found between two bounds, in its own unit."""

    name: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Solution:
    """Dimensions that meet the wanted values, and the figures of both drawings by finite elements.

    Parameters
    ----------
    values : mapping of str to float
        The dimensions found.
    drawn, found : mapping of str to float
        Figures of the drawing as it is, and with the dimensions found.
    """

    values: Mapping[str, float]
    drawn: Mapping[str, float]
    found: Mapping[str, float]


def parse_unknown(text: str, drawn: Callable[[str], float]) -> Unknown:
    """Parse the text `NAME` or `NAME=A:B`; without bounds, they are half and twice the drawn value.

    Raises
    ------
    UsageError
        If the text does not have this form, or the drawn value lies outside the bounds or is zero.
    """
    name, given, span = text.partition("=")
    now = drawn(name)
    low, high = sorted((now / _WITHIN, now * _WITHIN))
    if given:
        try:
            low, high = (float(part) for part in span.split(":"))
        except ValueError:
            low = high = np.nan
    if not low < high or not (isfinite(low) and isfinite(high)):
        raise UsageError(
            f"--solve must be the name of a number of the drawing that is not zero, or NAME=A:B with its bounds A < B, "
            f"such as hinge.thickness_mm=0.6:1.4, but is {text}."
        )
    if not low <= now <= high:
        raise UsageError(f"The bounds of {name} must include its drawn value, {now:g}, but are {low:g} to {high:g}.")
    return Unknown(name, low, high)


def parse_wanted(texts: Sequence[str], figures: Mapping[str, float]) -> dict[str, float]:
    """Parse texts `FIGURE=VALUE`; names may leave out units, blanks and punctuation.

    Raises
    ------
    UsageError
        If a figure is unknown or a value is not a number other than zero.
    """
    found = {}
    names = {_plain(name): name for name in figures}
    for text in texts:
        name, _, raw = text.rpartition("=")
        try:
            value = float(raw)
        except ValueError:
            value = 0.0
        if not (isfinite(value) and value):
            raise UsageError(f"--for must be FIGURE=VALUE with a number that is not zero, but is {text}.")
        if _plain(name) not in names:
            raise UsageError(f"--for must name a figure of the drawing, {', '.join(figures)}, but names {name}.")
        found[names[_plain(name)]] = value
    return found


def _plain(name: str) -> str:
    return re.sub(r"\[.*\]|[^a-z0-9]", "", name.lower())


def solve_dimensions(
    unknowns: Sequence[Unknown], wanted: Mapping[str, float], lumped: Figures, elements: Figures
) -> Solution:
    """Find the dimensions for which finite elements give the wanted figures.

    Parameters
    ----------
    unknowns : sequence of Unknown
        Dimensions to be found, as many as there are wanted figures.
    wanted : mapping of str to float
        Wanted values by the names of the figures.
    lumped, elements : callable
        Map values of dimensions, by name, to the figures of the drawing with these values; no values: as drawn.

    Raises
    ------
    UsageError, ModelError
        If the numbers of dimensions and figures differ, or no dimensions within the bounds give the wanted values.
    """
    if len(unknowns) != len(wanted):
        raise UsageError(f"As many --solve as --for are needed, but {len(unknowns)} and {len(wanted)} are given.")
    drawn, target = elements({}), np.array(list(wanted.values()))
    low, high = (np.array([getattr(u, of) for u in unknowns]) for of in ("low", "high"))

    def named(share: Array) -> dict[str, float]:
        return {u.name: float(v) for u, v in zip(unknowns, low + share * (high - low), strict=True)}

    def seen(figures: Figures, values: Mapping[str, float]) -> tuple[Mapping[str, float], Array]:
        try:
            found = figures(values)
        except FingervisionError as error:
            raise ModelError(f"With {_spelt(values)}: {error} Narrow the bounds of --solve.") from error
        return found, np.array([found.get(name, np.inf) for name in wanted])

    factor = seen(lumped, {})[1] / np.array([drawn[name] for name in wanted])
    share = np.full(len(unknowns), 0.5)
    for _ in range(_ROUNDS):
        aim = target * factor
        fit = least_squares(
            lambda x, aim=aim: seen(lumped, named(x))[1] / aim - 1.0, share, bounds=(0.0, 1.0), diff_step=_STEP,
            xtol=1e-5, ftol=1e-9, gtol=1e-9,
        )  # fmt: skip
        share, values = fit.x, named(fit.x)
        found, reached = seen(elements, values)
        if np.all(np.abs(reached / target - 1.0) < _MET):
            return Solution(values, drawn, found)
        if np.abs(fit.fun).max() > _MET:
            break
        factor = seen(lumped, values)[1] / reached
    nearest = ", ".join(f"{name} = {value:.5g}" for name, value in zip(wanted, reached, strict=True))
    bounds = ", ".join(f"{u.name} from {u.low:g} to {u.high:g}" for u in unknowns)
    raise ModelError(
        f"The wanted {_spelt(wanted)} must be within reach of {bounds}, but the nearest is {nearest} with "
        f"{_spelt(values)}; widen the bounds, or take another dimension."
    )


def _spelt(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.5g}" for name, value in values.items())

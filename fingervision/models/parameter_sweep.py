"""Vary the dimensions of a drawing: sweeps over a grid, and dimensions that give wanted figures.

The lumped model is solved for wanted figures, and its targets are corrected until finite elements of the drawing meet
the wanted values themselves (space mapping: Bandler et al., 1994, IEEE Transactions on Microwave Theory and Techniques
42, 2536, doi:10.1109/22.339794).
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import isfinite
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fingervision.domain.errors import FingervisionError, ModelError, UsageError
from fingervision.domain.gripper import Gripper
from fingervision.models.gripper_mechanism import check_outline, redrawn
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import mechanism_figures, quickest_model
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper
from fingervision.models.uncertainty import ratios, scaled

Array = NDArray[np.float64]

COLUMNS = (
    "gap_per_input",
    "input_stiffness_n_mm",
    "peak_stress_mpa_per_mm",
    "input_at_yield_mm",
    "contact_input_mm",
    "first_mode_drive_free_hz",
)
_MOST_VARIANTS = 2000
_MOST_MECHANISMS = 400
"""Most mechanisms in a sweep; each takes half a second."""


@dataclass(frozen=True, slots=True)
class Variation:
    """Values of one dimension of a drawing.

    Parameters
    ----------
    name : str
        Dotted name as in `gripper.toml`, such as `hinge.thickness_mm`.
    values : tuple of float
        Values in the dimension's own unit.
    """

    name: str
    values: tuple[float, ...]


def parse_variation(text: str) -> Variation:
    """Parse the text `NAME=A:B:N`.

    Raises
    ------
    UsageError
        If the text does not have this form.
    """
    name, _, span = text.partition("=")
    parts = span.split(":")
    try:
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (ValueError, IndexError):
        count = 0
    if len(parts) != 3 or not 2 <= count <= _MOST_VARIANTS or not np.all(np.isfinite([first, last])):
        raise UsageError(
            f"--vary must be NAME=A:B:N with numbers A and B and 2 to {_MOST_VARIANTS} values, such as "
            f"hinge.thickness_mm=0.6:1.4:9, but is {text}."
        )
    return Variation(name, tuple(np.linspace(first, last, count).tolist()))


def varied(gripper: Gripper, variations: Sequence[Variation], values: Sequence[float]) -> Gripper:
    """Return a gripper with some dimensions at given values, and dependent dimensions adapted."""
    for variation, value in zip(variations, values, strict=True):
        try:
            now = attrgetter(variation.name)(gripper)
        except AttributeError:
            now = None
        if not isinstance(now, float):
            raise UsageError(
                "--vary and --solve must name a number of the drawing as gripper.toml does, such as "
                f"hinge.thickness_mm, but {variation.name} is none."
            )
        gripper = redrawn(gripper, variation.name, value - now)
    return gripper


def sweep_answers(gripper: Gripper, variations: Sequence[Variation], theory: HingeTheory) -> tuple[Array, Array]:
    """Compute the responses for every combination of the varied dimensions.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    variations : sequence of Variation
        Axes of the grid; the last one varies fastest.
    theory : HingeTheory
        Theory of the hinges' compliance.

    Returns
    -------
    values : ndarray of float, shape (n, k)
        Values of the varied dimensions.
    answers : ndarray of float, shape (n, 6)
        Responses in the order of `COLUMNS`; infinite for a contact that never occurs.

    Raises
    ------
    DataError, ModelError, UsageError
        If a corner of the grid is not a valid gripper, or the grid is too large.
    """
    grid = _grid(variations, _MOST_VARIANTS)
    for corner in product(*((min(v.values), max(v.values)) for v in variations)):
        check_outline(varied(gripper, variations, corner), f"the variant {_spelt(_named(variations, corner))}")
    rows = []
    by = ratios(sweep_figures(LumpedGripper(gripper, theory=theory)),
                sweep_figures(StiffnessMatrixGripper(gripper, theory=theory)))  # fmt: skip
    for values in grid:
        drawn = varied(gripper, variations, values)
        rows.append(scaled(sweep_figures(StiffnessMatrixGripper(drawn, theory=theory)), by))
    return np.array(grid), np.array([list(row.values()) for row in rows], dtype=float)


def _grid(variations: Sequence[Variation], most: int) -> list[tuple[float, ...]]:
    """Every combination of the values of all variations."""
    grid = list(product(*(variation.values for variation in variations)))
    if len(grid) > most:
        raise UsageError(f"--vary must give at most {most} drawings, but gives {len(grid)}.")
    return grid


def sweep_figures(model: DrawnGripper) -> dict[str, float]:
    """Results for one drawing, by the names in `COLUMNS`."""
    stress, touch = model.peak_stress().mpa_per_mm, model.first_touch_mm
    at_yield = model.gripper.material.yield_mpa / stress
    mode = model.modes_hz(drive_held=False, count=1)[0]
    row = (model.gap_per_input, model.force_per_input_n_mm, stress, at_yield,
           -np.inf if touch is None else touch, mode)  # fmt: skip
    return dict(zip(COLUMNS, row, strict=True))


def mechanism_sweep_answers(
    redrawn_to: Callable[[Mapping[str, float]], Mechanism], variations: Sequence[Variation]
) -> tuple[Array, tuple[str, ...], Array]:
    """Compute the responses for every combination of the varied dimensions of a mechanism.

    Parameters
    ----------
    redrawn_to : callable
        Maps values of dimensions, by dotted name, to the drawing with these values.
    variations : sequence of Variation
        Axes of the grid; the last one varies fastest.

    Returns
    -------
    values : ndarray of float, shape (n, k)
        Values of the varied dimensions.
    columns : tuple of str
        Names of the figures computed by `mechanism_figures`.
    answers : ndarray of float, shape (n, columns)
        Figures of every drawing; infinite if a drawing has no such figure.

    Raises
    ------
    DataError, ModelError, UsageError
        If a drawing of the grid is not a valid mechanism, or the grid is too large.
    """
    grid = _grid(variations, _MOST_MECHANISMS)
    # Check the corners of the grid first, so that an invalid corner is reported before anything is computed.
    corners = list(product(*((v.values[0], v.values[-1]) for v in variations)))
    found = []
    for place, values in enumerate([*corners, *grid]):
        try:
            mechanism = redrawn_to(_named(variations, values))
            if place >= len(corners):
                found.append(mechanism_figures(quickest_model(mechanism)))
        except FingervisionError as error:
            raise ModelError(
                f"The variant {_spelt(_named(variations, values))} could not be computed: {error}"
            ) from error
    columns = tuple(dict.fromkeys(name for row in found for name in row if not name.startswith("model_error")))
    return np.array(grid), columns, np.array([[row.get(name, np.inf) for name in columns] for row in found])


def _named(variations: Sequence[Variation], values: Sequence[float]) -> dict[str, float]:
    return {variation.name: value for variation, value in zip(variations, values, strict=True)}


def _spelt(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in values.items())


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

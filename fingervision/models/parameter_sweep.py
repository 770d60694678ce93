"""Sweep over a grid of dimensions: results of the lumped model, approximated by a faster bar model times ratios."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

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
    grid = list(product(*(variation.values for variation in variations)))
    if len(grid) > _MOST_VARIANTS:
        raise UsageError(f"--vary must give at most {_MOST_VARIANTS} variants, but gives {len(grid)}.")
    for corner in product(*((min(v.values), max(v.values)) for v in variations)):
        check_outline(varied(gripper, variations, corner), f"the variant {_spelt(variations, corner)}")
    rows = []
    by = ratios(sweep_figures(LumpedGripper(gripper, theory=theory)),
                sweep_figures(StiffnessMatrixGripper(gripper, theory=theory)))  # fmt: skip
    for values in grid:
        drawn = varied(gripper, variations, values)
        rows.append(scaled(sweep_figures(StiffnessMatrixGripper(drawn, theory=theory)), by))
    return np.array(grid), np.array([list(row.values()) for row in rows], dtype=float)


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
    grid = list(product(*(variation.values for variation in variations)))
    if len(grid) > _MOST_MECHANISMS:
        raise UsageError(f"--vary must give at most {_MOST_MECHANISMS} mechanisms, but gives {len(grid)}.")
    # Check the corners of the grid first, so that an invalid corner is reported before anything is computed.
    corners = list(product(*((v.values[0], v.values[-1]) for v in variations)))
    found = []
    for place, values in enumerate([*corners, *grid]):
        try:
            mechanism = redrawn_to({v.name: value for v, value in zip(variations, values, strict=True)})
            if place >= len(corners):
                found.append(mechanism_figures(quickest_model(mechanism)))
        except FingervisionError as error:
            raise ModelError(f"The variant {_spelt(variations, values)} could not be computed: {error}") from error
    columns = tuple(dict.fromkeys(name for row in found for name in row if not name.startswith("model_error")))
    return np.array(grid), columns, np.array([[row.get(name, np.inf) for name in columns] for row in found])


def _spelt(variations: Sequence[Variation], values: Sequence[float]) -> str:
    return ", ".join(f"{v.name} = {value:g}" for v, value in zip(variations, values, strict=True))

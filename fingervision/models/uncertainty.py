"""Uncertainty of computed quantities from the stated uncertainties of a drawing's dimensions.

The propagation is linear (JCGM 100:2008, 5.1), by central differences of one standard uncertainty in either direction.
The second differences measure the nonlinearity. If the nonlinearity would shift the mean of a quantity, or widen its
uncertainty, by more than a tenth of the uncertainty, this quantity is sampled instead at Sobol points (Monte Carlo
method, JCGM 101:2008). The errors of the dimensions are assumed to be normally distributed and independent of each
other.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from fingervision.domain.errors import FingervisionError, ModelError
from fingervision.domain.gripper import Gripper
from fingervision.domain.parameter import Estimate
from fingervision.models.answer_figures import LINEAR, Physics
from fingervision.models.gripper_figures import gripper_figures
from fingervision.models.gripper_mechanism import check_outline, half_mechanism, redrawn
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import mechanism_figures, quickest_model
from fingervision.models.out_of_plane import out_of_plane
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper
from fingervision.models.triangulate import triangulate

# Approximate the numerical results of a model for drawings with changed dimensions, from the faster bar model.
#
# Each result of the bar model is multiplied by a ratio: the result of the accurate model over that of the bar model,
# for the unchanged drawing. A model with a meshed finger takes half a second to compute, a bar model a few
# milliseconds. If a result is not finite, or the ratio is not between 1/2 and 2, the result of the bar model is used
# without a ratio.

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


Array = NDArray[np.float64]
Evaluate = Callable[[Mapping[str, float]], Mapping[str, float | None]]

_BENDS = 0.1
"""Largest shift of the mean, or widening, that linear propagation may miss, as a share of the uncertainty; an
uncertainty is itself not known better than that."""
_NAMED = 3
_MOST_REFUSED = 0.05
"""Largest share of samples that may be invalid drawings: more would truncate the distribution."""
_ROUNDING = 1e-9
_LEAST_STEP = 1e-4
"""Least step of a difference, as a share of the dimension: smaller steps are lost in the rounding of a mesh."""


@dataclass(frozen=True, slots=True)
class FigureUncertainty:
    """One computed quantity with its uncertainty.

    Parameters
    ----------
    value : float
        Value for the drawing as given.
    u : float
        Standard uncertainty.
    sampled : bool
        Whether the uncertainty comes from samples; if False, from linear propagation.
    mean : float
        Mean of the samples; `value` for linear propagation.
    interval : (float, float)
        Interval of 95 % coverage: quantiles of the samples, or `value` +- 1.96 u.
    shares : tuple of (str, float)
        The three dimensions that contribute most, and their shares of the variance to second order, in falling order.
    """

    value: float
    u: float
    sampled: bool
    mean: float
    interval: tuple[float, float]
    shares: tuple[tuple[str, float], ...]


def propagate(
    evaluate: Evaluate, numbers: Mapping[str, Estimate], *, samples: int = 128, seed: int = 1
) -> dict[str, FigureUncertainty]:
    """Return every computed quantity with its uncertainty.

    Parameters
    ----------
    evaluate : callable
        Maps changes of some dimensions, each in its own unit, to the quantities; None for an unknown quantity.
    numbers : mapping of str to Estimate
        The uncertain dimensions with their standard uncertainties.
    samples : int
        Number of drawings to sample if linear propagation is not sufficient; a power of two.
    seed : int
        Seed of the random samples.

    Returns
    -------
    dict of str to FigureUncertainty
        Quantities that are known for every drawing evaluated and that depend on some dimension.

    Raises
    ------
    ModelError
        If the drawing is not valid with a dimension changed by its uncertainty, or too many samples are invalid
        drawings.
    """
    used = {name: estimate.u for name, estimate in numbers.items() if estimate.u}
    u = np.array(list(used.values())).reshape(-1, 1)
    step = np.maximum(u, _LEAST_STEP * np.abs([numbers[name].value for name in used]).reshape(-1, 1))
    answers = [evaluate({})]
    for name, (size,) in zip(used, step.tolist(), strict=True):
        answers += [_moved(evaluate, name, numbers[name].value, by) for by in (-size, size)]
    known = [figure for figure in answers[0] if all(answer[figure] is not None for answer in answers)]
    values = np.array([[answer[figure] for figure in known] for answer in answers], dtype=float)
    middle, low, high = values[0], values[1::2], values[2::2]
    slopes, bends = 0.5 * (high - low) * u / step, 0.5 * (low + high - 2.0 * middle) * (u / step) ** 2
    spread = np.sqrt(np.sum(slopes**2, axis=0))
    widening = np.sqrt(spread**2 + 2.0 * np.sum(bends**2, axis=0)) - spread
    missed = np.maximum(np.abs(bends.sum(axis=0)), widening)
    bent = missed > np.maximum(_BENDS * spread, _ROUNDING * np.abs(middle))
    sought = [figure for figure, is_bent in zip(known, bent.tolist(), strict=True) if is_bent]
    drawn = _samples(evaluate, used, sought, samples, seed) if sought else {}
    parts, found = slopes**2 + 2.0 * bends**2, {}
    for place, figure in enumerate(known):
        value, linear_u, own = float(middle[place]), float(spread[place]), drawn.get(figure)
        if linear_u <= _ROUNDING * abs(value) and own is None:
            continue
        shares = parts[:, place] / parts[:, place].sum()
        largest = [(list(used)[k], float(shares[k])) for k in np.argsort(-shares, kind="stable")[:_NAMED]]
        if own is None:
            ends = (value - 1.96 * linear_u, value + 1.96 * linear_u)
            found[figure] = FigureUncertainty(value, linear_u, False, value, ends, tuple(largest))
        else:
            ends = (float(np.quantile(own, 0.025)), float(np.quantile(own, 0.975)))
            u_own = float(own.std(ddof=1))
            found[figure] = FigureUncertainty(value, u_own, True, float(own.mean()), ends, tuple(largest))
    return found


def _moved(evaluate: Evaluate, name: str, value: float, by: float) -> Mapping[str, float | None]:
    try:
        return evaluate({name: by})
    except FingervisionError as error:
        raise ModelError(
            f"The uncertainty of {name} is too large: with {name} = {value + by:g}, one standard uncertainty from its "
            f"stated value, the drawing cannot be computed ({str(error).rstrip('.')}). State a smaller uncertainty."
        ) from error


def _samples(
    evaluate: Evaluate, used: Mapping[str, float], figures: list[str], count: int, seed: int
) -> dict[str, Array]:
    """Quantities of drawings whose dimensions are sampled from independent normal distributions."""
    points = qmc.Sobol(len(used), seed=seed).random(count)
    # Clip the outermost samples: one extreme value would represent a whole interval of 1 / count, which changes u of a
    # nonlinear quantity by 18 %.
    normal = ndtri(np.clip(points, 0.5 / count, 1.0 - 0.5 / count))
    rows: dict[str, list[float]] = {figure: [] for figure in figures}
    refused, last = 0, ""
    for row in normal:
        try:
            answer = evaluate({name: float(z * u) for z, (name, u) in zip(row, used.items(), strict=True)})
        except FingervisionError as error:
            refused, last = refused + 1, str(error)
            continue
        for figure in list(rows):
            value = answer[figure]
            if value is None:
                del rows[figure]
            else:
                rows[figure].append(value)
    if refused > _MOST_REFUSED * count:
        raise ModelError(
            f"The stated uncertainties are too large: of {count} drawings with random dimensions according to these "
            f"uncertainties, {refused} cannot be computed. State smaller uncertainties. The last failure: {last}"
        )
    return {figure: np.array(values) for figure, values in rows.items()}


# Uncertainty of a gripper's characteristic numbers from the stated uncertainties of its dimensions.

_ANY_SIGN = ("_deg", "l1_mm", "l2_mm", "l3_mm", "l4_mm", "face_y_mm", "_per_k")
_MOST_POISSON = 0.5
_FLAT_ACROSS, _FLAT_BODY = 1.0, 0.1
"""Mesh of changed drawings out of the plane, as in `out_of_plane`, with polynomials of order 1: for the published
sample, derivatives are within 2 % (hinges, plate, finger) to 5 % (radius) of those of the fine mesh."""


def gripper_uncertainty(
    gripper: Gripper,
    inputs: Sequence[float] | NDArray[np.float64],
    theory: HingeTheory = HingeTheory.CORRECTED,
    physics: Physics = LINEAR,
    *,
    across_plane: bool = True,
) -> dict[str, FigureUncertainty]:
    """Propagate the stated uncertainties of a drawing to every number of `gripper_figures`.

    The numbers of drawings with changed dimensions come from the lumped model, for small displacements, with contact if
    the physics includes contact; numbers out of the plane come from a coarse mesh in three dimensions. The model of
    bars computes the ratio of each changed number to that of the given drawing. Finite elements for every changed
    drawing would take minutes, whereas an uncertainty needs only two digits. The uncertainty from the lumped model is
    stated for all kinds of model.

    Parameters
    ----------
    gripper : Gripper
        Drawing with its `uncertainties`.
    inputs : sequence of float
        Inputs whose smallest and largest value are the ends of the range.
    theory : HingeTheory
        Theory of the hinges' compliance.
    physics : Physics
        Which effects beyond small displacements are included.
    across_plane : bool
        Whether the numbers out of the plane are included.
    """
    check_uncertainties(gripper)
    numbers = _numbers(gripper)

    touching = Physics(contact=physics.contact)

    def by_bars(changes: Mapping[str, float]) -> dict[str, float | None]:
        drawn = _changed(gripper, changes)
        return gripper_figures(drawn, StiffnessMatrixGripper(drawn, touching, theory), inputs)

    def lifted(changes: Mapping[str, float]) -> dict[str, float | None]:
        half = half_mechanism(_changed(gripper, changes))
        mesh = triangulate(half.region, _FLAT_ACROSS, _FLAT_BODY * half.region.size_mm)
        found = out_of_plane(half, mesh=mesh, order=1)
        return {"first_out_of_plane_mode_hz": found.modes_hz[0], "sag_out_of_plane_mm": found.sag_mm["right tip"]}

    in_plane = in_ratio(by_bars, gripper_figures(gripper, LumpedGripper(gripper, touching, theory), inputs))
    across = propagate(lifted, numbers, samples=_SAMPLES) if across_plane else {}
    return propagate(in_plane, numbers) | across


def check_uncertainties(gripper: Gripper) -> None:
    """Refuse stated uncertainties for which no changed drawing exists.

    Raises
    ------
    DataError, ModelError
        If a change of a dimension by one standard uncertainty in either direction gives no valid gripper.
    """
    for name, estimate in _numbers(gripper).items():
        for by in (-(estimate.u or 0.0), estimate.u or 0.0):
            try:
                drawn = _changed(gripper, {name: by})
                check_outline(drawn, "the changed drawing")
            except FingervisionError as error:
                raise ModelError(
                    f"The uncertainty of {name} is too large: with {name} = {estimate.value + by:g}, one standard "
                    f"uncertainty from its stated value, the drawing is invalid ({str(error).rstrip('.')}). State a "
                    "smaller uncertainty."
                ) from error


def _numbers(gripper: Gripper) -> dict[str, Estimate]:
    return {name: Estimate(attrgetter(name)(gripper), u) for name, u in gripper.uncertainties.items() if u > 0.0}


def _changed(gripper: Gripper, changes: Mapping[str, float]) -> Gripper:
    """Return the gripper with changed dimensions; refuse dimensions that are not possible for a gripper."""
    for name, by in changes.items():
        value = attrgetter(name)(gripper) + by
        if not name.endswith(_ANY_SIGN) and value <= 0.0:
            raise ModelError(f"{name} must be positive, but its uncertainty includes {value:g}: state a smaller u.")
        if name == "material.poisson_ratio" and value >= _MOST_POISSON:
            raise ModelError(f"{name} must be below 0.5, but its uncertainty includes {value:g}: state a smaller u.")
    for name, by in changes.items():
        gripper = redrawn(gripper, name, by)
    return gripper


# Uncertainty of a mechanism's characteristic numbers from the stated uncertainties of its dimensions.

_SAMPLES = 32
"""Number of drawings sampled, at half a second each, if linear propagation is not sufficient: the standard uncertainty
is then known within about a tenth."""


def mechanism_uncertainty(
    redrawn: Callable[[Mapping[str, float]], Mechanism], numbers: Mapping[str, Estimate]
) -> dict[str, FigureUncertainty]:
    """Propagate stated uncertainties to every number of `mechanism_figures`.

    Drawings with changed dimensions are computed by the lumped model, or by finite elements if the drawing has no
    flexures; their uncertainty is stated for all kinds of model.

    Parameters
    ----------
    redrawn : callable
        Maps changes of some dimensions, each in its own unit, to the changed drawing: `MechanismDrawing.mechanism`.
    numbers : mapping of str to Estimate
        The uncertain dimensions: `MechanismDrawing.estimates`.
    """
    return propagate(lambda changes: mechanism_figures(quickest_model(redrawn(changes))), numbers, samples=_SAMPLES)

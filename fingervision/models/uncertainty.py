"""Uncertainty of computed quantities from the stated uncertainties of a drawing's dimensions.

The propagation is linear (JCGM 100:2008, 5.1), by central differences of one standard uncertainty in either direction.
The second differences measure the nonlinearity. If the nonlinearity would shift the mean of a quantity, or widen its
uncertainty, by more than a tenth of the uncertainty, this quantity is sampled instead at Sobol points (Monte Carlo
method, JCGM 101:2008). The errors of the dimensions are assumed to be normally distributed and independent of each
other.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from fingervision.domain.errors import FingervisionError, ModelError
from fingervision.domain.parameter import Estimate

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
    used = {name: estimate.u or 0.0 for name, estimate in numbers.items() if estimate.u}
    base = evaluate({})
    slopes: dict[str, dict[str, float]] = {figure: {} for figure, value in base.items() if value is not None}
    bends: dict[str, dict[str, float]] = {figure: {} for figure in slopes}
    for name, u in used.items():
        step = max(u, _LEAST_STEP * abs(numbers[name].value))
        low, high = (_moved(evaluate, name, numbers[name].value, by) for by in (-step, step))
        for figure in list(slopes):
            a, b, middle = low[figure], high[figure], base[figure]
            if a is None or b is None or middle is None:
                del slopes[figure], bends[figure]
                continue
            slopes[figure][name] = 0.5 * (b - a) * u / step
            bends[figure][name] = 0.5 * (a + b - 2.0 * middle) * (u / step) ** 2
    spread = {figure: sqrt(sum(s**2 for s in own.values())) for figure, own in slopes.items()}
    bent = [f for f, u in spread.items() if _is_bent(u, list(bends[f].values()), float(base[f] or 0.0))]
    drawn = _samples(evaluate, used, bent, samples, seed) if bent else {}
    found = {}
    for figure, u in spread.items():
        value = float(base[figure] or 0.0)
        if u <= _ROUNDING * abs(value) and figure not in drawn:
            continue
        parts = {name: s**2 + 2.0 * bends[figure][name] ** 2 for name, s in slopes[figure].items()}
        shares = sorted(((name, part / sum(parts.values())) for name, part in parts.items()), key=lambda pair: -pair[1])
        own = drawn.get(figure)
        found[figure] = FigureUncertainty(
            value=value,
            u=u if own is None else float(own.std(ddof=1)),
            sampled=own is not None,
            mean=value if own is None else float(own.mean()),
            interval=(value - 1.96 * u, value + 1.96 * u)
            if own is None
            else (float(np.quantile(own, 0.025)), float(np.quantile(own, 0.975))),
            shares=tuple(shares[:_NAMED]),
        )
    return found


def _moved(evaluate: Evaluate, name: str, value: float, by: float) -> Mapping[str, float | None]:
    try:
        return evaluate({name: by})
    except FingervisionError as error:
        raise ModelError(
            f"The uncertainty of {name} is too large: with {name} = {value + by:g}, one standard uncertainty from its "
            f"stated value, the drawing cannot be computed ({str(error).rstrip('.')}). State a smaller uncertainty."
        ) from error


def _is_bent(u: float, bends: list[float], value: float) -> bool:
    shift, widening = abs(sum(bends)), sqrt(u**2 + 2.0 * sum(b**2 for b in bends)) - u
    return max(shift, widening) > max(_BENDS * u, _ROUNDING * abs(value))


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

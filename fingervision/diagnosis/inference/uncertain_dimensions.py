"""Uncertain dimensions of the drawing, refitted within their uncertainties together with the effects.

The dimensions theta are random effects (Henderson 1950): the measurement is M(theta_0) + J (theta - theta_0), with the
model M, its Jacobian J and the drawn values theta_0; theta - theta_0 is normally distributed about zero with the stated
uncertainty. The Jacobian J is evaluated at the last estimate; the prior stays centred on the drawn value.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.inference.random_effect import DRAWING, estimated_coefficients
from fingervision.domain.effect import Array
from fingervision.domain.model import PhysicalModel

STEP = 0.1
"""Step of the derivatives, as a share of the standard uncertainty."""
FARTHEST = 6.0
"""Largest change of a dimension, in standard uncertainties; its normal prior makes larger changes improbable."""
BENT = 1.0
"""Largest error of the linearised prediction, in chi-square, for which the search is not repeated."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawingRefit:
    """How the prediction changes if the drawing's uncertain dimensions change, in linear approximation.

    Parameters
    ----------
    columns : ndarray of float, shape (m, p)
        Change of the stacked prediction per standard uncertainty of each dimension.
    moved : mapping of str to float
        Present deviation of each dimension from its drawn value in the model, in standard uncertainties, by dotted
        name.
    known : mapping of str to float
        Share of each standard uncertainty that remains after the measurement.
    """

    columns: Array
    moved: Mapping[str, float]
    known: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def shift(self) -> Array:
        """Change of the prediction due to the refit, in linear approximation; shape (m,)."""
        return np.asarray(self.columns @ np.array(list(self.moved.values())), dtype=np.float64)


def tangent(chain: MeasuringChain, drawn: PhysicalModel, moved: Mapping[str, float]) -> DrawingRefit:
    """Differentiate the prediction with respect to the drawing's uncertain dimensions, at their present values.

    Parameters
    ----------
    chain : MeasuringChain
        History and fixed effects.
    drawn : PhysicalModel
        The drawn gripper.
    moved : mapping of str to float
        Deviations of the dimensions in standard uncertainties.
    """
    columns, names = [], []
    for name in drawn.uncertain:
        ends = [
            replace(chain, model=drawn.redrawn(_changes(drawn, {**moved, name: moved.get(name, 0.0) + step}))).stacked(
                {}
            )
            for step in (-STEP, STEP)
        ]
        column = (ends[1] - ends[0]) / (2.0 * STEP)
        if np.any(np.abs(column) > 1e-12):  # a density or a yield stress does not change the prediction
            columns.append(column)
            names.append(name)
    size = chain.stacked({}).size
    kept = np.stack(columns, axis=1) if columns else np.zeros((size, 0))
    return DrawingRefit(kept, {name: moved.get(name, 0.0) for name in names})


def with_moved(drawn: PhysicalModel, moved: Mapping[str, float]) -> PhysicalModel:
    """Return the gripper, computed again, with each dimension changed by a number of its standard uncertainties."""
    return drawn.drawn_anew(_changes(drawn, moved))


def _changes(drawn: PhysicalModel, moved: Mapping[str, float]) -> dict[str, float]:
    return {name: by * (drawn.uncertain[name].u or 0.0) for name, by in moved.items()}


def estimated(
    refit: DrawingRefit, problem: Problem, explanation: Explanation
) -> tuple[dict[str, float], dict[str, float]]:
    """Estimate the dimensions for an explanation, and their remaining uncertainty.

    Returns
    -------
    moved, known : dict of str to float
        Deviations, and remaining uncertainties, in standard uncertainties, by dotted name.
    """
    best, covariance = estimated_coefficients(problem, explanation, DRAWING)
    left = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    names = list(refit.moved)
    return (
        dict(zip(names, np.clip(best, -FARTHEST, FARTHEST).tolist(), strict=True)),
        dict(zip(names, left.tolist(), strict=True)),
    )

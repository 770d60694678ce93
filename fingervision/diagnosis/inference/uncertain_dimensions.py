"""Uncertain dimensions of the drawing, refitted within their uncertainties together with the effects.

They enter as random effects (Henderson 1950): y = M(theta) + J (theta - theta_0), with theta - theta_0 normal about
zero with the stated uncertainty. J is evaluated at the last estimate; the prior stays centred on the drawn value.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import Array
from fingervision.domain.model import PhysicalModel

STEP = 0.1
"""Of the uncertainty: the step that the derivatives are taken over."""
FARTHEST = 6.0
"""Standard uncertainties that a number may be redrawn by; its normal prior hardly ever lets it come so far."""
BENT = 1.0
"""Chi-square by which a tangent may miss the body itself before the search is worth repeating."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawingRefit:
    """Change of the prediction by the drawing's uncertain dimensions.

    Parameters
    ----------
    columns : ndarray of float, shape (m, p)
        Change of the stacked prediction by one standard uncertainty of each.
    moved : mapping of str to float
        How many standard uncertainties each stands from its drawn value in the model, by dotted name.
    known : mapping of str to float
        Share of the uncertainty that the measurement leaves.
    """

    columns: Array
    moved: Mapping[str, float]
    known: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def shift(self) -> Array:
        """Change of the prediction by the refit, by its tangent; shape (m,)."""
        return np.asarray(self.columns @ np.array(list(self.moved.values())), dtype=np.float64)


def tangent(chain: MeasuringChain, drawn: PhysicalModel, moved: Mapping[str, float]) -> DrawingRefit:
    """Differentiate the prediction by the drawing's uncertain dimensions, at their present values.

    Parameters
    ----------
    chain : MeasuringChain
        History and fixed effects.
    drawn : PhysicalModel
        The gripper as drawn.
    moved : mapping of str to float
        In standard uncertainties.
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
        if np.any(np.abs(column) > 1e-12):  # a density or a yield stress moves nothing
            columns.append(column)
            names.append(name)
    size = chain.stacked({}).size
    kept = np.stack(columns, axis=1) if columns else np.zeros((size, 0))
    return DrawingRefit(kept, {name: moved.get(name, 0.0) for name in names})


def with_moved(drawn: PhysicalModel, moved: Mapping[str, float]) -> PhysicalModel:
    """Return the gripper, computed anew, with each dimension moved by this number of its standard uncertainties."""
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
        In standard uncertainties, by dotted name.
    """
    offsets = problem.offsets
    metric = offsets.metric(explanation.sigma_mm)
    count = refit.columns.shape[1]
    best = (metric @ (offsets.design.T @ explanation.residual))[-count:]
    left = np.sqrt(np.maximum(np.diag(metric)[-count:], 0.0))
    names = list(refit.moved)
    return (
        dict(zip(names, np.clip(best, -FARTHEST, FARTHEST).tolist(), strict=True)),
        dict(zip(names, left.tolist(), strict=True)),
    )

"""Uncertainty of a mechanism's figures from the stated uncertainties of its dimensions."""

from collections.abc import Callable, Mapping

from fingervision.domain.parameter import Estimate
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import mechanism_figures
from fingervision.models.mechanism_frame import MechanismFrame
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.uncertainty import FigureUncertainty, propagate

_SAMPLES = 32
"""Drawings of half a second each where linear propagation is not enough: u is then known within about a tenth."""


def mechanism_uncertainty(
    redrawn: Callable[[Mapping[str, float]], Mechanism], numbers: Mapping[str, Estimate]
) -> dict[str, FigureUncertainty]:
    """Propagate stated uncertainties to every figure of `mechanism_figures`.

    Changed drawings are computed by lumped flexures, or by finite elements where the drawing has none; the same
    uncertainty is stated for the other kinds of model.

    Parameters
    ----------
    redrawn : callable
        Changes of some numbers, each in its own unit, to the drawing: `MechanismDrawing.mechanism`.
    numbers : mapping of str to Estimate
        The uncertain numbers: `MechanismDrawing.estimates`.
    """

    def evaluate(changes: Mapping[str, float]) -> Mapping[str, float | None]:
        mechanism = redrawn(changes)
        return mechanism_figures(MechanismFrame(mechanism) if mechanism.flexures else MechanismPlate(mechanism))

    return propagate(evaluate, numbers, samples=_SAMPLES)

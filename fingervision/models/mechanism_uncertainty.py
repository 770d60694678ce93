"""Uncertainty of a mechanism's characteristic numbers from the stated uncertainties of its dimensions."""

from collections.abc import Callable, Mapping

from fingervision.domain.parameter import Estimate
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import mechanism_figures
from fingervision.models.mechanism_frame import MechanismFrame
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.uncertainty import FigureUncertainty, propagate

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

    def evaluate(changes: Mapping[str, float]) -> Mapping[str, float | None]:
        mechanism = redrawn(changes)
        return mechanism_figures(MechanismFrame(mechanism) if mechanism.flexures else MechanismPlate(mechanism))

    return propagate(evaluate, numbers, samples=_SAMPLES)

"""Input of a law of the drawing: the drawing, its small-displacement response, and its body in the deformed shape."""

from dataclasses import dataclass

from fingervision.domain.gripper import Gripper
from fingervision.models.driven_body import DrivenBody
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.small_answer import RatioCurves


@dataclass(frozen=True, slots=True, eq=False)
class DrawnAnswer:
    """Response of a drawing, as computed by one kind of model.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Of the hinges.
    body : DrivenBody
        The right half, as the kind of model has it.
    input_range_mm : (float, float)
        Inputs that the model is meant for.
    lever : RatioCurves or None
        Along a change of the lever's length l2: the link that the amplification hangs on.
    """

    gripper: Gripper
    theory: HingeTheory
    body: DrivenBody
    input_range_mm: tuple[float, float]
    lever: RatioCurves | None

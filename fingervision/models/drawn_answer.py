"""Data from which effects of a drawing are computed: drawing, elastic body, response to a changed lever."""

from dataclasses import dataclass

from fingervision.domain.gripper import Gripper
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.small_answer import RatioCurves


@dataclass(frozen=True, slots=True, eq=False)
class DrawnAnswer:
    """A drawing and its elastic response, as computed by one kind of model.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.
    model : DrawnGripper
        The gripper for small displacements, as this kind of model computes it.
    input_range_mm : (float, float)
        Smallest and largest input for which the model is valid.
    lever : RatioCurves or None
        Ratio of changed to unchanged response over the input, for a change of the length l2 of the lever arm that
        determines the amplification.
    """

    gripper: Gripper
    theory: HingeTheory
    model: DrawnGripper
    input_range_mm: tuple[float, float]
    lever: RatioCurves | None

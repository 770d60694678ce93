"""Wrong hinge thickness or modulus of elasticity: the force changes, the gap hardly or not at all."""

from dataclasses import replace

from fingervision.domain.effect import History, Values
from fingervision.domain.model import PhysicalLaw
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response
from fingervision.models.gripper_mechanism import redrawn
from fingervision.models.small_answer import DrawnAnswer, ratio_curves

EFFECT = "hinge_stiffness_error"
_SHARE = Parameter("thickness_share", "", 0.0, 1.0, "share of the hinges' thickness in it; the rest is the modulus",
                   neutral=None, starts=2)  # fmt: skip
_THINNEST, _THICKEST = 0.3, 1.4
_LEAST = 1e-3


def law(drawn: DrawnAnswer) -> PhysicalLaw | None:
    """Change the thickness of all hinges and the modulus so that the force changes by the given ratio.

    The thickness contributes the factor (1 + ratio)^p to the force, where p is `thickness_share`. The modulus, which
    does not affect the gap, contributes the remaining factor (1 + ratio)^(1 - p) to the force. For the published
    gripper, hinges thinner by 0.1 mm make the opening 0.17 % wider and the force 22 % smaller.
    """
    thickness_mm = drawn.gripper.hinge.thickness_mm
    curves = ratio_curves(
        drawn.gripper,
        drawn.theory,
        lambda by: redrawn(drawn.gripper, "hinge.thickness_mm", by),
        (_THINNEST - 1.0) * thickness_mm,
        (_THICKEST - 1.0) * thickness_mm,
    )
    if curves is None:
        return None

    def act(response: Response, history: History, values: Values) -> Response:
        force_ratio = max(1.0 + values["ratio"], _LEAST)
        gain = curves.gap_at_force(force_ratio ** values.get(_SHARE.name, 1.0))
        moved = response.with_gap(history.rest_gap_mm + gain * (response.gap_mm - history.rest_gap_mm))
        return moved if moved.force_n is None else replace(moved, force_n=force_ratio * moved.force_n)

    return PhysicalLaw(act, (_SHARE,))

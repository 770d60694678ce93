"""Wrong lever length: a change of the arm l2 alters the ratio of gap to input, and the force nearly twice as much."""

from dataclasses import replace

from fingervision.domain.effect import History, Values
from fingervision.domain.model import PhysicalLaw
from fingervision.domain.response import Response
from fingervision.models.small_answer import DrawnAnswer

EFFECT = "lever_ratio_error"


def law(drawn: DrawnAnswer) -> PhysicalLaw | None:
    """Multiply the opening by 1 + `ratio`, and the force by the factor for the same change of the lever length l2."""
    curves = drawn.lever
    if curves is None:
        return None

    def act(response: Response, history: History, values: Values) -> Response:
        ratio = 1.0 + values["ratio"]
        moved = response.with_gap(history.rest_gap_mm + ratio * (response.gap_mm - history.rest_gap_mm))
        if moved.force_n is None:
            return moved
        return replace(moved, force_n=curves.force_at_gap(ratio) * moved.force_n)

    return PhysicalLaw(act)

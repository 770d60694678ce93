"""Unequal halves: a link of one half differs in length, so that this finger moves more or less than in the drawing."""

from dataclasses import replace

from fingervision.domain.effect import History, Values
from fingervision.domain.model import PhysicalLaw
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response
from fingervision.models.small_answer import DrawnAnswer

EFFECT = "assembly_asymmetry"
_HALF = Parameter("changed_half", "", -1.0, 1.0, "half whose link differs: 1 right, -1 left, 0 both oppositely",
                  neutral=None, starts=2)  # fmt: skip

_LEAST = 0.1
"""Least value of the divisor 1 - 2 changed_half share. At this value one finger hardly opens, and the share cannot grow
further."""


def law(drawn: DrawnAnswer) -> PhysicalLaw | None:
    """Change the link lengths of the halves so that the right half has the given share of the opening.

    The right finger moves by 1/2 + share and the left finger by 1/2 - share of an opening that is G times the opening
    of the drawing. If only the right half is changed, the left finger moves as in the drawing, so that G (1 - 2 share)
    = 1; if only the left half is changed, G (1 + 2 share) = 1. In general, the opening is multiplied by G = 1 / (1 - 2
    changed_half share); at changed_half = 0 the gap does not change, as for a model given as a table.
    """
    curves = drawn.lever
    if curves is None:
        return None

    def act(response: Response, history: History, values: Values) -> Response:
        share = values["share"]
        gain = 1.0 / max(1.0 - 2.0 * values.get(_HALF.name, 0.0) * share, _LEAST)
        opening_mm = response.gap_mm - history.rest_gap_mm
        moved = response.with_gap(history.rest_gap_mm + gain * opening_mm).shifted(share * gain * opening_mm)
        if moved.force_n is None:
            return moved
        right, left = (curves.force_at_gap(gain * (1.0 + sign * 2.0 * share)) for sign in (1.0, -1.0))
        return replace(moved, force_n=0.5 * (right + left) * moved.force_n)

    return PhysicalLaw(act, (_HALF,))

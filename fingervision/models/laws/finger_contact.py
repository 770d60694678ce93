"""Finger contact: Signorini's condition at the tips of the drawn body, and the drive force needed to close further."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import History, Values
from fingervision.domain.model import PhysicalLaw
from fingervision.domain.response import Response
from fingervision.models.small_answer import DrawnAnswer

EFFECT = "finger_contact"
_DEPTHS = 60
_AS_DRAWN = 0.01
"""Uncertainty of the gap at contact that is predicted from the drawing, as a share of the gap at rest: the accuracy to
which tips are made."""
_RIGID = 0.05
"""Largest yielding of faces that still count as rigid, as a share of the distance by which the fingers are held
back."""


def law(drawn: DrawnAnswer) -> PhysicalLaw | None:
    """Stop the fingers as computed for the body in the drawing, and add the corresponding force at the drive.

    The measuring point lies beside the contact point, so that even between rigid faces it continues to move by a
    fraction of the closing (`remaining_slope`). If the faces are soft, the measuring point moves further, and
    proportionally less force is needed.
    """
    model, (lowest_mm, highest_mm) = drawn.model, drawn.input_range_mm
    touch_mm = model.first_touch_mm
    if touch_mm is None or not lowest_mm < touch_mm < highest_mm:
        return None
    slope, floor_mm = model.gap_per_input, model.rest_gap_mm + model.gap_per_input * touch_mm
    inputs = np.linspace(touch_mm, lowest_mm, _DEPTHS)[1:]
    states = [model.elastic.driven.equilibrium(float(value), contact=True) for value in inputs]
    free_mm = model.rest_gap_mm + slope * inputs
    missing = np.concatenate([[0.0], floor_mm - free_mm])
    held = np.concatenate([[0.0], [model.gap_change_mm(s.displacement) for s in states] - slope * inputs])
    free_n = model.force_per_input_n_mm * inputs
    extra_n = np.concatenate([[0.0], [s.force_n for s in states] - free_n])
    rigid_slope = 1.0 - held[1] / missing[1]
    beyond = (
        (held[-1] - held[-2]) / (missing[-1] - missing[-2]),
        (extra_n[-1] - extra_n[-2]) / (missing[-1] - missing[-2]),
    )

    def act(response: Response, history: History, values: Values) -> Response:
        del history
        deep = np.maximum(values["floor_mm"] - response.gap_mm, 0.0)
        share = (1.0 - values["remaining_slope"]) / (1.0 - rigid_slope)
        past = np.maximum(deep - missing[-1], 0.0)
        moved = response.with_gap(response.gap_mm + share * (np.interp(deep, missing, held) + beyond[0] * past))
        if moved.force_n is None:
            return moved
        return replace(moved, force_n=moved.force_n + share * (np.interp(deep, missing, extra_n) + beyond[1] * past))

    near_mm = _AS_DRAWN * model.rest_gap_mm
    return PhysicalLaw(
        act,
        foretold={"floor_mm": (floor_mm - near_mm, floor_mm + near_mm), "remaining_slope": (0.0, rigid_slope + _RIGID)},
    )

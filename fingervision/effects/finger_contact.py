"""Finger contact: the fingers touch each other, so that the gap does not close further."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.further_check import FurtherCheck
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: the fingers touch each other, so that the gap does not close further."""
    missing_mm = np.maximum(values["floor_mm"] - response.gap_mm, 0.0)
    return response.with_gap(response.gap_mm + (1.0 - values["remaining_slope"]) * missing_mm)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    lowest_mm = max(0.0, history.rest_gap_mm - history.closing_mm)
    if history.closing_mm <= 0.0:
        return "the gripper is never closed below its rest gap"
    if history.rest_gap_mm <= lowest_mm:
        return "the gap at rest is not above zero, so that the fingers cannot move towards each other"
    floor, slope = EFFECT.parameters
    return replace(floor, lower=lowest_mm, upper=history.rest_gap_mm, neutral=lowest_mm), slope


EFFECT = PointEffect(
    name="finger_contact",
    stage=Stage.MECHANISM,
    order=150,
    words="the fingers touch and do not close further",
    formula="where g < floor_mm: floor_mm - remaining_slope (floor_mm - g), shared equally",
    source="unilateral contact with compliance",
    residual="zero until the fingers touch; then positive, because the simulation closes further than the fingers",
    parameters=(
        Parameter("floor_mm", "mm", 0.0, 100.0, "gap at which the fingers touch", starts=10),
        Parameter(
            "remaining_slope",
            "",
            0.0,
            0.5,
            "share of the closing that continues after the touch",
            neutral=None,
            starts=2,
        ),
    ),
    narrow=narrow,
    checks={FurtherCheck.FORCE: True},
    stands_at=("closed",),
    drawn_with={"floor_mm": 1.5},
    demonstrated=True,
    act=act,
)

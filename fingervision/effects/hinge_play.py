"""Hinge play: the pin of a pivot lies against the side of its hole to which the load presses it."""

import numpy as np

from fingervision.domain.drawing_form import DrawingForm, DrawnPart
from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Reduce the opening by half the play on either side of rest: a simulation table does not describe pivots."""
    opening_mm = response.gap_mm - history.rest_gap_mm
    half_mm = 0.5 * values["play_mm"]
    return response.with_gap(history.rest_gap_mm + opening_mm - np.clip(opening_mm, -half_mm, half_mm))


EFFECT = PointEffect(
    name="hinge_play",
    stage=Stage.MECHANISM,
    order=172,
    words="a pivot has play, which is crossed where the load on the pivot changes sign",
    formula="o - clip(o, +-play_mm / 2); with a drawing, the pin takes the position of least elastic "
    "energy in its hole",
    source="frictionless contact of a pin in a hole",
    residual="a step where the load on the pivot changes sign; the poses of the bodies show which pivot",
    parameters=(Parameter("play_mm", "mm", 0.0, 0.5, "full width of the play", typical=0.02),),
    needs_bodies=True,
    in_drawing=DrawingForm(
        DrawnPart.PIVOT, Parameter("play_mm", "mm", 0.0, 0.5, "full width of the play", typical=0.02), reference=0.01
    ),
    act=act,
)

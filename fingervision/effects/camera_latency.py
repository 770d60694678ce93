"""Frames are stamped late."""

from dataclasses import replace

import numpy as np

from fingervision.domain.effect import History, PointEffect, Stage, Values
from fingervision.domain.parameter import Parameter
from fingervision.domain.response import Response


def act(response: Response, history: History, values: Values) -> Response:
    """Apply the effect: frames are stamped late."""
    if values["delay_s"] == 0.0:
        return response
    left_mm, right_mm = np.empty_like(response.left_mm), np.empty_like(response.right_mm)
    for run in history.runs:
        time_s = history.times[run]
        late_s = time_s - values["delay_s"]
        left_mm[run] = np.interp(late_s, time_s, response.left_mm[run])
        right_mm[run] = np.interp(late_s, time_s, response.right_mm[run])
    return replace(response, left_mm=left_mm, right_mm=right_mm)


EFFECT = PointEffect(
    name="camera_latency",
    stage=Stage.CAMERA,
    order=250,
    words="frames are stamped late",
    formula="everything at t - delay_s",
    source="a pure delay",
    residual="proportional to the speed of the points, drifts included",
    parameters=(Parameter("delay_s", "s", 0.0, 1.0, "delay", starts=8, logarithmic=True),),
    needs_times=True,
    act=act,
)

"""A dynamic model along a measured path, split into its static response and a dynamic remainder.

The chain of effects is evaluated thousands of times, but one evaluation of a dynamic model takes seconds. The model is
therefore split into its static response, a table on which drive effects act, and a dynamic remainder computed once
along the driven path. The dynamic remainder is computed again along the path that results from the effects found.
"""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain, Settings
from fingervision.domain.effect import Array, DriveEffect, History
from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.response import Response
from fingervision.models.corrected import CorrectedModel
from fingervision.models.function_model import HOLDS_S, FunctionModel
from fingervision.motion.input_path import recorded

PREPARED_S = HOLDS_S[0]
"""Time for which the model is held at a run's first input before the run starts."""


def at_rest_beside(table: MeasuredTable, model: CorrectedModel) -> tuple[CorrectedModel, FunctionModel | None]:
    """Replace a dynamic model by its static response at the inputs of a table.

    Raises
    ------
    DataError
        If the table has no times.
    """
    if not isinstance(model.base, FunctionModel):
        return model, None
    if table.time_s is None:
        raise DataError(
            f"{model.base_path or model.name} computes the gap from the input over time, but the measured table has no "
            "column time_s: add it, or give a table of static gaps as the model."
        )
    inputs, _, _ = recorded(table)
    static = model.base.at_rest(float(inputs.min()), float(inputs.max()))
    return replace(model, base=static, input_range_mm=static.input_range_mm), model.base


def with_dynamics(chain: MeasuringChain, function: FunctionModel, settings: Settings) -> MeasuringChain:
    """Add the difference between a dynamic model and its static response, along the path after the drive effects."""
    history = chain.along.history
    driven_mm = _behind_drive(chain, history, {**chain.fixed, **settings})
    jobs = []
    for run in history.runs:
        time_s = _rising(history.times[run] - history.times[run][0]) + PREPARED_S
        inputs = driven_mm[run]
        jobs.append((np.concatenate([[0.0], time_s]), np.concatenate([inputs[:1], inputs])))
    answers = function.simulate(jobs)
    left, right = np.empty(driven_mm.size), np.empty(driven_mm.size)
    force = None if answers[0].force_n is None else np.empty(driven_mm.size)
    for run, answer in zip(history.runs, answers, strict=True):
        left[run], right[run] = answer.left_mm[1:], answer.right_mm[1:]
        if force is not None and answer.force_n is not None:
            force[run] = answer.force_n[1:]
    rest = chain.model.respond(driven_mm)
    more = None if force is None or rest.force_n is None else force - rest.force_n
    return replace(chain, dynamics=(history.times, Response(left - rest.left_mm, right - rest.right_mm, more)))


def _behind_drive(chain: MeasuringChain, history: History, acting: Settings) -> Array:
    input_mm = history.input_mm
    for name, effect in chain.effects.items():
        if name in acting and isinstance(effect, DriveEffect):
            input_mm = effect.act(input_mm, history, acting[name])
    return input_mm


def _rising(time_s: Array) -> Array:
    """Separate equal times by a nanosecond, because a function of time needs increasing times."""
    return np.asarray(np.maximum.accumulate(time_s) + 1e-9 * np.arange(1, time_s.size + 1))

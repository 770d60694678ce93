"""Prediction error for a run that was not used in a fit, relative to that of the judge's prediction."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.catalogue_chain import Effects, Samples, respond
from tests.benchmarks.hidden.design import unseen_motion
from tests.benchmarks.hidden.explanations import problem_of
from tests.benchmarks.hidden.noise import edge_errors
from tests.benchmarks.hidden.table_cache import JudgedTable

Array = NDArray[np.float64]


def unseen_error_ratio(table: JudgedTable, effects: Effects) -> float:
    """RMS of both edges of a noisy unseen run minus the prediction, divided by the same with the judge's effects.

    The midline's constant is a free parameter.
    """
    experiment = table.experiment
    rate = experiment.design.rate_hz
    start_s = 0.0 if experiment.design.time_restarts else experiment.starts_s()[-1] * 0.5
    trace = experiment.plant.trace(
        unseen_motion(experiment.plant.inputs), rate, start_s, len(experiment.design.motions)
    )
    at = Samples(trace.input_mm, trace.run_time_s, trace.table_time_s, np.array([0, len(trace.input_mm)]))
    model = problem_of(experiment, [trace], known_input=True).model
    clean = replace(experiment.noise, outlier_share=0.0, run_offset_mm=0.0)
    errors = edge_errors(np.random.default_rng([experiment.seed, 11]), clean, len(trace.input_mm))
    left, right = trace.left_mm + errors[0], trace.right_mm + errors[1]
    gap, midline = right - left, (left + right) / 2

    def error_mm(prediction: tuple[Array, Array]) -> float:
        off = midline - prediction[1]
        off = off - off.mean()
        return float(np.sqrt(np.mean(off**2 + (gap - prediction[0]) ** 2 / 4)))

    # The start state of the unseen run is unknown; both predictions assume the centre.
    judge = respond(model, at, table.judgement.effects)
    asked = respond(model, at, effects)
    return error_mm((asked[0], asked[1])) / error_mm((judge[0], judge[1]))

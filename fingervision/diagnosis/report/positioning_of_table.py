"""Positioning accuracy of a measured table compared with its model and the result of a diagnosis, in one call."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fingervision.diagnosis.input.repeated_targets import NoRepeatedTargets, repeated_targets
from fingervision.diagnosis.report.positioning_report import PositioningReport, effect_changes, positioning_report
from fingervision.domain.effect import Array, Flags, Values

STAGE_SLOPE = 0.05
"""Largest difference of the model's slope from one for which the gap counts as the position of an axis. Scale errors of
stages are a few parts in a thousand. A gripper amplifies the input several times, so that position minus target has no
meaning."""
LINE = 1e-9
"""Deviation of a model from the straight line, as a share of its range, below which it counts as the line: rounding."""
MODEL = "the model"
"""Name under which the share of the model's own deviation from the targets (a map of position errors) is reported."""
TARGET, SIMULATION = "target", "model"
"""References from which deviations are measured."""


def positioning_of_table(
    input_mm: Array,
    measured: Flags,
    runs: Sequence[slice],
    time_s: Array | None,
    gap_mm: Array,
    predict_mm: Callable[[Mapping[str, Values]], Array],
    answer: Mapping[str, Values],
) -> PositioningReport | NoRepeatedTargets:
    """Compute the positioning accuracy, if the table has repeated targets.

    If the model's gap follows the input one to one, as on a stage, a deviation is measured gap minus recorded input, as
    in an ISO 230-2 report. For a stage, the share of the model's prediction is reported together with the shares of the
    effects. For any other model than that of a stage, a deviation is the measured gap minus the simulated gap. A
    constant added to all deviations (such as a rest gap) changes none of the quantities.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Inputs of the path in order of time, including rows without a reading.
    measured : ndarray of bool, shape (n,)
        Rows with a reading; m is their number.
    runs : sequence of slice
        Rows of each run.
    time_s : ndarray of float, shape (n,), or None
        Times.
    gap_mm : ndarray of float, shape (m,)
        Measured gaps.
    predict_mm : callable
        Predicted gap at the m readings, for given effects and their parameters.
    answer : mapping of str to mapping of str to float
        Effects found, with their parameters.
    """
    visits = repeated_targets(input_mm, measured, runs, time_s)
    if isinstance(visits, NoRepeatedTargets):
        return visits
    inputs, plain = input_mm[measured], predict_mm({})
    changes = effect_changes(predict_mm, answer)
    after = gap_mm - predict_mm(answer)
    slope = float(np.polyfit(inputs - inputs.mean(), plain, 1)[0])
    sign = -1 if slope < 0.0 else 1
    if abs(abs(slope) - 1.0) > STAGE_SLOPE:
        return positioning_report(visits, gap_mm - plain, after if answer else None, changes, SIMULATION, sign)
    ideal = sign * inputs
    departure = plain - ideal
    if np.ptp(departure) > LINE * np.ptp(inputs):
        changes = {MODEL: departure, **changes}
    return positioning_report(visits, gap_mm - ideal, after if changes else None, changes, TARGET, sign)

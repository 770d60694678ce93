"""Positioning figures of a measured table compared with its model and the result of a diagnosis, in one call."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fingervision.diagnosis.input.repeated_targets import NoRepeatedTargets, repeated_targets
from fingervision.diagnosis.report.positioning_report import PositioningReport, effect_changes, positioning_report
from fingervision.domain.effect import Array, Flags, Values

STAGE_SLOPE = 0.05
"""Largest difference of the model's slope from one to one at which its gap is the position of an axis. Scales of stages
are off by parts in a thousand; a gripper amplifies several times, and position minus target means nothing there."""
LINE = 1e-9
"""Departure of a model from the straight line, of its range, below which it is the line: the rounding of its digits."""
MODEL = "the model"
"""Name under which the model's own departure from the targets (a map of position errors) has its share."""
TARGET, SIMULATION = "target", "model"
"""What deviations are taken from."""


def positioning_of_table(
    input_mm: Array,
    measured: Flags,
    runs: Sequence[slice],
    time_s: Array | None,
    gap_mm: Array,
    predict_mm: Callable[[Mapping[str, Values]], Array],
    answer: Mapping[str, Values],
) -> PositioningReport | NoRepeatedTargets:
    """Compute the positioning figures where the table has repeated targets.

    If the model's gap follows the input one to one, as on a stage, a deviation is measured gap minus recorded input, as
    in an ISO 230-2 report. The share of the model's prediction is then reported beside those of the effects. Otherwise
    a deviation is measured minus simulated gap. A constant added to all deviations (a rest gap) changes no figure.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        The path in the order of travel, rows without a reading among them.
    measured : ndarray of bool, shape (n,)
        Rows that have a reading; m of them.
    runs : sequence of slice
        Rows of each run.
    time_s : ndarray of float, shape (n,), or None
        Times.
    gap_mm : ndarray of float, shape (m,)
        Readings.
    predict_mm : callable
        Predicted gap of the m readings for the effects that act, by their parameters.
    answer : mapping of str to mapping of str to float
        Effects of the answer and their parameters.
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

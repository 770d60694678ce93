"""Mistaken columns of a table: units of length that are confused, and an input that stands in the column of the gap."""

import numpy as np

from fingervision.diagnosis.inference.evidence import STRONG
from fingervision.domain.effect import Array, Flags
from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.model import Model
from fingervision.models.corrected import CorrectedModel

HALF = 0.5
"""Largest share of a variance that a mistake in the table may leave, if it is the mistake and not an effect that
explains the table."""
UNIT_SHARES = (0.1, 3.0)
"""Smallest and largest share of the model's range that the inputs cover, after a change of unit, if the input was
apparently given in that unit. Runs cover at least a tenth of the range."""
MISTAKES = {
    "has the opposite sign": -1.0,
    "is in nanometres": 1e6,
    "is in micrometres": 1e3,
    "is in metres": 1e-3,
    "is in hundredths of a millimetre": 100.0,
    "is in tenths of a millimetre": 10.0,
    "is in centimetres": 0.1,
    "is in inches": 1.0 / 25.4,
}
"""Factors between a column and one in millimetres, with the words for such a column."""
UNITS = tuple(sorted({max(factor, 1.0 / factor) for factor in MISTAKES.values() if factor > 0.0}))
"""Ratios of units of length that are confused."""
THOUSANDS = (1e6, 1e3, 1e-3)
"""Factors that leave no doubt: no run is a thousand times as long as the model's range, or a thousandth of it."""
MODEL_POINTS = 2000
"""Number of inputs at which the inverse of the model is interpolated."""


def refuse_other_inputs(table: MeasuredTable, model: CorrectedModel) -> None:
    """Refuse a table whose inputs are in another unit than the model's, or outside the model's range."""
    input_mm, (low, high) = table.input_mm, model.input_range_mm
    share, runs = float(np.ptp(input_mm)) / (high - low), f"{input_mm.min():g} to {input_mm.max():g}"
    outside = ~_within(input_mm, low, high)
    # A run that is mostly within the range is a right one of which the model covers too little.
    far = float(np.mean(outside)) > 0.5
    mistakes = [
        words
        for words, factor in MISTAKES.items()
        if UNIT_SHARES[0] < share / abs(factor) < UNIT_SHARES[1]
        and (factor in THOUSANDS or (far and _within(input_mm / factor, low, high).all()))
    ]
    if outside.any() and _fits_exchanged(table, model, ~outside):
        mistakes = ["was exchanged with gap_mm"]
    if mistakes or outside.any():
        is_drawn = hasattr(type(model.base), "places")
        ends = ", where a flexure yields or parts touch" if is_drawn else ""
        advice = ["leave those rows out", *(f"correct the column if it {words}" for words in mistakes)]
        advice = advice if is_drawn else ["simulate the missing inputs", *advice]
        raise DataError(
            f"input_mm must lie within the model's {low:g} to {high:g} mm{ends}, but runs from {runs}: "
            f"{', or '.join(advice)}."
        )


def exchanged_gap_mm(model: Model, range_mm: tuple[float, float], input_mm: Array, gap_mm: Array) -> Array | None:
    """Gap that the model predicts if the columns of input and gap are exchanged, shape (n,) (mm).

    The column called gap then follows the inverse of the model. None is returned if the model has no inverse, or does
    not cover the table this way.
    """
    low_mm, high_mm = range_mm
    inputs_mm = np.linspace(low_mm, high_mm, MODEL_POINTS)
    gaps_mm = model.respond(inputs_mm).gap_mm
    way = np.sign(gaps_mm[-1] - gaps_mm[0])
    covered = _within(gap_mm, low_mm, high_mm) & _within(input_mm, gaps_mm.min(), gaps_mm.max())
    if not covered.all() or np.any(way * np.diff(gaps_mm) <= 0.0):
        return None
    return np.asarray(np.interp(way * input_mm, way * gaps_mm, inputs_mm))


def _fits_exchanged(table: MeasuredTable, model: CorrectedModel, inside: Flags) -> bool:
    """Whether the model covers the table with input and gap exchanged, and then fits far better than as it is.

    Parameters
    ----------
    inside : ndarray of bool, shape (n,)
        Rows whose input lies in the model's range; if they are the minority, there is nothing to compare with.
    """
    following_mm = exchanged_gap_mm(model.base, model.input_range_mm, table.input_mm, table.gap_mm)
    if following_mm is None or np.mean(inside) < 0.5:
        return following_mm is not None
    gap_mm = table.gap_mm[inside]
    predictions_mm = model.base.respond(table.input_mm[inside]).gap_mm, following_mm[inside]
    here, exchanged = (float(np.var(gap_mm - predicted_mm)) for predicted_mm in predictions_mm)
    # -2 log odds of 20 to 1, with a noise of unknown level in both.
    odds = float(inside.sum()) * float(np.log(here / max(exchanged, 1e-300)))
    return exchanged < HALF * float(np.var(gap_mm)) and odds > STRONG


def _within(values: Array, low: float, high: float) -> Flags:
    """Whether each value lies in a range, or at its ends but for rounding; shape (n,)."""
    slack = 1e-9 * (high - low)
    return np.asarray((values >= low - slack) & (values <= high + slack))

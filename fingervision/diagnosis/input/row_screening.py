"""Exclude rows without information, such as a zero that was set instead of measured."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import theilslopes

from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.model import Model
from fingervision.models.table import TableModel

SET_SHARE = 1e-5
"""Relative difference from the model's rest gap below which a row at input zero counts as set, because no gap is
measured with such accuracy."""
OFF_LINE = 0.01
"""Share of the simulated range: a table that is otherwise straight within half of this share has a fault where it
deviates by more."""

MOST_SET = 0.2
"""Share of rows at input 0 above which these rows are measurements at rest, not a value that was set."""


def screened_rows(table: MeasuredTable, model: Model, rest_gap_mm: float) -> tuple[NDArray[np.bool_], list[str]]:
    """Mark the excluded rows, shape (n,), and give the reasons as sentences.

    Only tables without times are screened, because tables without times are small and made by hand.
    """
    out = np.zeros(table.input_mm.size, dtype=bool)
    notes: list[str] = []
    if table.time_s is not None:
        return out, notes
    put = (table.input_mm == 0.0) & (np.abs(table.gap_mm - rest_gap_mm) <= SET_SHARE * rest_gap_mm)
    if put.any() and put.sum() < MOST_SET * put.size:
        out |= put
        notes.append(
            f"the row at input 0 agrees with the simulated rest gap of {rest_gap_mm:.4g} mm to its last digit: it was "
            "probably set instead of measured, and was set aside in the fit."
        )
    if isinstance(model, TableModel) and model.input_mm.size >= 8:
        gap = model.right_mm - model.left_mm
        slope = theilslopes(gap, model.input_mm)[0]
        intercept = np.median(gap - slope * model.input_mm)
        off = np.abs(gap - intercept - slope * model.input_mm)
        faulty = off > OFF_LINE * np.ptp(gap)
        faulty[[0, -1]] = False
        if 0 < faulty.sum() <= gap.size // 4 and np.median(off) < 0.5 * OFF_LINE * np.ptp(gap):
            places = model.input_mm[faulty]
            out |= np.isin(table.input_mm, places)
            notes.append(
                f"the simulation deviates from its own straight line at input {', '.join(f'{x:g}' for x in places)} "
                "mm: check these rows of the model; measured rows at these inputs were set aside in the fit."
            )
    return out, notes

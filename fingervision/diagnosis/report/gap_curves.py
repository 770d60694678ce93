"""Measured and predicted gaps for the plots of a report."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.report.sentences import COVERAGE_FACTOR
from fingervision.domain.effect import Array, Flags

STANDS = 1e-4
"""Share of the range within which the stage counts as at rest; its direction is then that of the previous motion."""


@dataclass(frozen=True, slots=True, eq=False)
class GapCurves:
    """A measurement and the predictions of models, row by row.

    Parameters
    ----------
    input_mm, gap_mm : ndarray of float, shape (n,)
        Recorded input and measured gap.
    expanded_mm : ndarray of float, shape (n,)
        Expanded random uncertainty of each gap (k = 2).
    opens : ndarray of bool, shape (n,)
        Rows that were reached with increasing input.
    time_s : ndarray of float, shape (n,), or None
        Time since the first row; None if the runs have no common clock.
    runs : tuple of slice
        Rows of each run.
    predictions : mapping of str to ndarray of float, shape (n,)
        Predicted gap, by its name in the legend.
    directed : bool
        Whether the order of the rows is known, and with it the direction of the motion.
    """

    input_mm: Array
    gap_mm: Array
    expanded_mm: Array
    opens: Flags
    time_s: Array | None
    runs: tuple[slice, ...]
    predictions: Mapping[str, Array]
    directed: bool = True


def gap_curves(data: Observations, noise_mm: float, predictions: Mapping[str, Array]) -> GapCurves:
    """Combine a measurement with predictions.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    noise_mm : float
        Random noise of one gap, for rows whose uncertainty was not measured.
    predictions : mapping of str to ndarray of float, shape (channels * n,)
        Stacked predictions, of which the gap is the first channel.
    """
    history, table = data.chain.history, data.table
    n = history.input_mm.size
    u_mm = np.full(n, noise_mm) if table.u_random_mm is None else np.asarray(table.u_random_mm, dtype=np.float64)
    return GapCurves(
        input_mm=history.input_mm,
        gap_mm=np.asarray(table.gap_mm, dtype=np.float64),
        expanded_mm=COVERAGE_FACTOR * u_mm,
        opens=_opens(history.input_mm, history.runs),
        time_s=history.clock_s if history.time_s is not None and history.shared_clock else None,
        runs=history.runs,
        predictions={name: stacked[:n] for name, stacked in predictions.items()},
        directed=history.time_s is not None,
    )


def _opens(input_mm: Array, runs: tuple[slice, ...]) -> Flags:
    """Mark rows at which the input had increased.

    A row at rest takes the direction of the previous or the next motion.
    """
    out = np.zeros(input_mm.size, dtype=bool)
    least_mm = STANDS * max(float(np.ptp(input_mm)), 1e-300)
    for run in runs:
        way = np.diff(input_mm[run], prepend=input_mm[run][:1])
        moves = np.flatnonzero(np.abs(way) > least_mm)
        if not moves.size:
            continue
        last = np.searchsorted(moves, np.arange(way.size), side="right") - 1
        out[run] = way[moves[np.maximum(last, 0)]] > 0.0
    return out

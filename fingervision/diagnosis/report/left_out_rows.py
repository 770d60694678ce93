"""Rows set aside in the fit: which they are, when they were measured, and whether stated numbers include them."""

from collections.abc import Mapping, Sequence

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Problem
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import Array

ODD_SIGMAS = 2.5
"""Deviation in standard deviations above which a row of a short table is mentioned, even if it was not excluded."""
FEW_ROWS = 60
"""Number of rows up to which a table counts as short."""
FIRST = 3
"""Number of rows that the sentence names; all are in report.json."""

OutlierRow = Mapping[str, object]


def outlier_rows(
    data: Observations, problem: Problem, after_mm: Array, left_out: Sequence[int]
) -> tuple[OutlierRow, ...]:
    """Describe the rows set aside: time (or number, from 1), input, deviation, and whether they count.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    problem : Problem
        Problem with the rows set aside.
    after_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted values.
    left_out : sequence of int
        Rows that the figures of the report do not count.
    """
    table, uncounted = data.table, frozenset(left_out)
    n, both = table.input_mm.size, data.chain.history.both_edges
    # The name of the run is needed only if times restart in each run.
    restarts = table.time_s is not None and not table.shared_clock
    out: list[OutlierRow] = []
    for run, name in zip(table.runs, table.run_names, strict=True):
        for i in (np.flatnonzero(problem.whitener.aside[run]) + run.start).tolist():
            when = {"row": i + 1} if table.time_s is None else {"time_s": float(table.time_s[i])}
            off = {"gap_off_mm": float(after_mm[i])}
            if both:
                off["midline_off_mm"] = float(after_mm[n + i])
            which = {"run": name} if restarts else {}
            out.append({**which, **when, "input_mm": float(table.input_mm[i]), **off, "counted": i not in uncounted})
    return tuple(out)


def outside_words(residual: Array, low: float, high: float) -> str:
    """Number of left-out rows that lie outside a plot from `low` to `high`, and how far; empty if there are none."""
    outside = residual[(residual < low) | (residual > high)]
    if not outside.size:
        return ""
    far = " and ".join(f"{end:+.2g}" for end in sorted({outside.min(), outside.max()}))
    return f"{outside.size} of {residual.size} rows left out lie outside the plot ({far})"


def outliers(data: Observations, problem: Problem, rows: Sequence[OutlierRow], after_mm: Array) -> tuple[str, ...]:
    """Sentences with the number of excluded rows and the first of them, and with the odd rows of a short table."""
    n = data.table.input_mm.size
    out = [_sentence(rows, n)] if rows else []
    if n <= FEW_ROWS:
        gap = after_mm[:n] - np.median(after_mm[:n])
        scale = 1.4826 * float(np.median(np.abs(gap)))
        aside = problem.whitener.aside
        out += [
            f"the row at input {data.table.input_mm[i]:g} mm lies {gap[i]:+.3g} mm away from the others "
            f"({'left out' if aside[i] else 'kept'})."
            for i in np.flatnonzero(np.abs(gap) > ODD_SIGMAS * scale)
        ]
    return tuple(out)


def _sentence(rows: Sequence[OutlierRow], n: int) -> str:
    """Sentence with the number of rows set aside, the first of them, and the number of those that still count."""
    first = [
        (f"{row['time_s']:g} s" if "time_s" in row else f"row {row['row']}")
        + (f" of run {row['run']}" if row.get("run") else "")
        for row in rows[:FIRST]
    ]
    more = f" and {len(rows) - FIRST} more (outlier_rows in report.json)" if len(rows) > FIRST else ""
    words = f"{len(rows)} of {n} samples were left out of the fit as outliers: {', '.join(first)}{more}"
    counted = sum(bool(row["counted"]) for row in rows)
    if counted:
        words += (
            f"; {counted} of them {'is' if counted == 1 else 'are'} the peak of a wider deviation, and included "
            f"in the RMS"
        )
    return f"{words}."

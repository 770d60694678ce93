"""Data of the charts on a report's HTML page, as JSON for the page's script."""

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.report.gap_curves import GapCurves
from fingervision.diagnosis.report.left_out_rows import outside_words
from fingervision.domain.effect import Array, Flags

MOST_ROWS = 3000
"""Most rows in a chart: more than the columns of a screen, and few enough for an HTML page of one megabyte."""
DASHES: tuple[list[int], ...] = ([6, 4], [], [8, 3, 2, 3], [2, 3])
"""Dash patterns of the predictions, in their order, so that they are distinguishable without their colours."""

Chart = dict[str, object]


def charts_of(curves: GapCurves, residual_mm: dict[str, Array], left_out: Sequence[int] = ()) -> list[Chart]:
    """Compose the charts: gap and residual over the input, and over time if the runs have a common clock.

    Parameters
    ----------
    curves : GapCurves
        Measurement and predictions.
    residual_mm : dict of ndarray of float, shape (n,)
        Measured minus predicted gap, by the name of the prediction.
    left_out : sequence of int
        Rows that the figures of the report do not count: drawn grey, and not considered by the scale.
    """
    counts = np.ones(curves.input_mm.size, dtype=bool)
    counts[list(left_out)] = False
    found = [_gap(curves, "gap-input", curves.input_mm, "input, mm", both_ways=True)]
    if curves.time_s is not None:
        found.append(_gap(curves, "gap-time", curves.time_s, "time, s", both_ways=False))
    found.append(_residuals(residual_mm, "residual-input", curves.input_mm, "input, mm", counts))
    if curves.time_s is not None:
        found.append(_residuals(residual_mm, "residual-time", curves.time_s, "time, s", counts))
    return found


def charts_json(charts: list[Chart]) -> str:
    """Encode the charts so that no name in them can end the script element."""
    return json.dumps(charts, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _shown(x: Array) -> tuple[NDArray[np.intp], str]:
    """Rows in ascending order of `x`, evenly thinned, with a remark if some rows are omitted."""
    step = max(1, -(-x.size // MOST_ROWS))
    rows = np.arange(0, x.size, step)
    return rows[np.argsort(x[rows], kind="stable")], "" if step == 1 else f" (each {step}th row)"


def _values(values: Array, rows: NDArray[np.intp], where: Flags | None = None) -> list[float | None]:
    return [
        round(float(values[k]), 6) if where is None or where[k] else None for k in rows.tolist()  # a nanometre
    ]  # fmt: skip


def _gap(curves: GapCurves, name: str, x: Array, label: str, *, both_ways: bool) -> Chart:
    rows, thinned = _shown(x)
    ways: dict[str, Flags | None] = {"": None}
    if both_ways and curves.directed:
        found = {"opening": curves.opens, "closing": ~curves.opens}
        ways = {way: where for way, where in found.items() if where.any()}
    series: list[dict[str, object]] = [
        {"label": f"measured {way}".strip(), "points": True, "filled": way == "opening", "colour": 0, "dash": [],
         "values": _values(curves.gap_mm, rows, where)}
        for way, where in ways.items()
    ]  # fmt: skip
    for number, (model, gap_mm) in enumerate(curves.predictions.items()):
        dash = DASHES[number % len(DASHES)]
        for way, where in ways.items():
            series.append(
                {"label": f"{model} {way}".strip(), "points": False, "filled": False,
                 "colour": 1 + number % 5, "dash": dash, "values": _values(gap_mm, rows, where)}
            )  # fmt: skip
    return {"id": name, "x": label, "y": f"gap, mm{thinned}", "at": _values(x, rows), "series": series}


def _residuals(residual_mm: dict[str, Array], name: str, x: Array, label: str, counts: Flags) -> Chart:
    rows, thinned = _shown(x)
    series: list[dict[str, object]] = [
        {"label": f"measured minus {model}", "points": True, "filled": number > 0, "colour": 1 + number % 5, "dash": [],
         "values": _values(residual, rows, counts)}
        for number, (model, residual) in enumerate(residual_mm.items())
    ]  # fmt: skip
    note = ""
    if not counts.all():
        last = list(residual_mm.values())[-1]
        series.append(
            {"label": "left out", "points": True, "filled": False, "colour": 0, "dash": [], "aside": True,
             "values": _values(last, rows, ~counts)}
        )  # fmt: skip
        shown = np.concatenate([residual[counts] for residual in residual_mm.values()])
        note = outside_words(last[~counts], *(float(end(shown)) for end in (np.min, np.max))) if shown.size else ""
    return {
        "note": note,
        "id": name,
        "x": label,
        "y": f"difference of the gap, mm{thinned}",
        "at": _values(x, rows),
        "series": series,
    }

"""Parts of a report's HTML page: tables, lists, machine-readable numbers, and charts that need no network."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.report.left_out_rows import outside_words
from fingervision.diagnosis.report.sentences import COVERAGE_FACTOR, limit_words
from fingervision.domain.effect import Array, Flags, History
from fingervision.domain.parameter import Estimate
from fingervision.storage.provenance import Provenance

# Measured and predicted gaps for the plots of a report.


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


# Data of the charts on a report's HTML page, as JSON for the page's script.


MOST_ROWS = 3000
"""Most rows in a chart: more than the columns of a screen, and few enough for an HTML page of one megabyte."""
DASHES: tuple[list[int], ...] = ([6, 4], [], [8, 3, 2, 3], [2, 3])
"""Dash patterns of the predictions, in their order, so that they are distinguishable without their colours."""

Chart = dict[str, object]


def charts_of(
    curves: GapCurves, residuals: Mapping[str, Mapping[str, Array]], left_out: Sequence[int] = ()
) -> list[Chart]:
    """Compose the charts: gap and residuals over the input, and over time if the runs have a common clock.

    Parameters
    ----------
    curves : GapCurves
        Measurement and predictions.
    residuals : mapping of str to mapping of str to ndarray of float, shape (n,)
        Measured minus predicted values, by channel and by the name of the prediction.
    left_out : sequence of int
        Rows that the figures of the report do not count: drawn grey, and not considered by the scale.
    """
    counts = np.ones(curves.input_mm.size, dtype=bool)
    counts[list(left_out)] = False
    axes = [("input", "the input", "input, mm", curves.input_mm)]
    axes += [] if curves.time_s is None else [("time", "time", "time, s", curves.time_s)]
    found = [
        {"words": f"Gap over {over}, measured and predicted", **_gap(curves, f"gap-{end}", x, label, end == "input")}
        for end, over, label, x in axes
    ]
    for channel, residual in residuals.items():
        of, unit = "" if channel == "gap" else f"-{channel}", "N" if channel == "force" else "mm"
        series = {f"measured minus {model}": values for model, values in residual.items()}
        found += [
            {
                "words": f"Measured minus predicted {channel} over {over}",
                **_residuals(series, f"residual-{end}{of}", (x, label), f"difference of the {channel}, {unit}", counts),
            }
            for end, over, label, x in axes
        ]
    return found


def effect_charts(name: str, residual: Mapping[str, Array], history: History) -> list[Chart]:
    """Charts of what an effect alone does, over the input and over time."""
    every = np.ones(history.input_mm.size, dtype=bool)
    what = f"measured minus simulated, {'N' if 'force' in residual else 'mm'}"
    axes = {"input": (history.input_mm, "input, mm"), "time": (history.clock_s, "time, s")}
    return [
        {
            "words": f"{name} alone, in a simulated gripper that opens and closes, over {end}",
            **_residuals(residual, f"effect-{name}-{end}", axis, what, every),
        }
        for end, axis in axes.items()
    ]


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


def _gap(curves: GapCurves, name: str, x: Array, label: str, both_ways: bool) -> Chart:
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


def _residuals(residuals: Mapping[str, Array], name: str, axis: tuple[Array, str], what: str, counts: Flags) -> Chart:
    """Chart of several residuals over an axis: its values and its label."""
    rows, thinned = _shown(axis[0])
    series: list[dict[str, object]] = [
        {"label": label, "points": True, "filled": number > 0, "colour": 1 + number % 5, "dash": [],
         "values": _values(residual, rows, counts)}
        for number, (label, residual) in enumerate(residuals.items())
    ]  # fmt: skip
    note = ""
    if not counts.all():
        last = list(residuals.values())[-1]
        series.append(
            {"label": "left out", "points": True, "filled": False, "colour": 0, "dash": [], "aside": True,
             "values": _values(last, rows, ~counts)}
        )  # fmt: skip
        shown = np.concatenate([residual[counts] for residual in residuals.values()])
        note = outside_words(last[~counts], *(float(end(shown)) for end in (np.min, np.max))) if shown.size else ""
    return {
        "note": note,
        "id": name,
        "x": axis[1],
        "y": f"{what}{thinned}",
        "at": _values(axis[0], rows),
        "series": series,
    }


PAGE = Path(__file__).parent / "page"
# The chart library of the live page (uPlot, MIT licence) is used here too.
CHARTS = Path(__file__).parents[2] / "live" / "page"
HINT = "Drag to zoom, double-click to see all; with the keyboard: arrows read values, + and - zoom, 0 shows all."


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Table whose cells are already HTML; wide tables have their own scroll bar."""
    top = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll" tabindex="0" role="group"><table><tr>{top}</tr>{body}</table></div>'


def bullets(items: Sequence[str]) -> str:
    """HTML list of sentences; an empty list becomes a sentence that there are none."""
    return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>" if items else "<p>Nothing.</p>"


def number(value: float | None, unit: str = "mm", digits: int = 4) -> str:
    """HTML of a number: rounded for a reader, and with its full value for programs (the `data` element)."""
    if value is None:
        return "-"
    return f'<data value="{value!r}">{value:.{digits}g}</data> {escape(unit)}'.rstrip()


def named(name: str) -> str:
    """Write an identifier so that it may break at its underscores on a narrow screen."""
    return escape(name).replace("_", "_<wbr>")


def with_uncertainty(e: Estimate) -> list[str]:
    """Value and expanded uncertainty, rounded to a tenth of the standard uncertainty."""
    limit = limit_words(e)
    if limit:
        return [escape(limit), "limited on one side only"]
    if e.u is None:
        return [number(e.value, e.unit, 5), "at a bound"]
    places = max(0, 1 - math.floor(math.log10(e.u))) if e.u > 0.0 else 6
    value = f'<data value="{e.value!r}">{e.value:.{places}f}</data> {escape(e.unit)}'
    return [value, f"{COVERAGE_FACTOR * e.u:.{places}f} {escape(e.unit)}".rstrip()]


def charts_html(charts: Sequence[Chart], begins: str) -> str:
    """HTML placeholders for the charts whose names begin as stated, each with a line for the value under the cursor."""
    return "".join(_placeholder(found) for found in charts if str(found["id"]).startswith(begins))


def _placeholder(found: Chart) -> str:
    name, words = (escape(str(found[key]), quote=True) for key in ("id", "words"))
    note = f'<p class="hint">{escape(str(found["note"]))}.</p>' if found.get("note") else ""
    return (
        f'<div class="chart" id="{name}" tabindex="0" role="group" aria-label="{words}. {HINT}"></div>'
        f'<p class="readout" aria-live="polite"></p>{note}'
    )


def provenance_html(made: Provenance) -> str:
    """HTML with the files, the command and the versions from which a result was obtained."""
    files = table(
        ["used as", "file", "bytes", "SHA-256"],
        [
            [escape(f.role), escape(f.name), f"{f.size_bytes}", f"<code>{f.sha256}</code>"]
            for f in made.files
        ],
    )  # fmt: skip
    versions = ", ".join(f"{name} {version}" for name, version in made.versions.items())
    how = f"<p>Made {escape(made.made_at)} by <code>{escape(made.command)}</code> with {escape(versions)}.</p>"
    return f"{files}{how}<p>To cite: {escape(made.citation)}</p>"


def page(title: str, heading: str, verdict: str, sections: Sequence[tuple[str, str]], charts: list[Chart]) -> str:
    """Compose a whole HTML page that contains styles, charts and data, so that it opens without a network."""
    style = (CHARTS / "uPlot.min.css").read_text(encoding="utf-8") + (PAGE / "report.css").read_text(encoding="utf-8")
    library = (CHARTS / "uPlot.iife.min.js").read_text(encoding="utf-8")
    script = (PAGE / "charts.js").read_text(encoding="utf-8")
    body = "".join(f"<section><h2>{escape(name)}</h2>{content}</section>" for name, content in sections)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        # Without an icon, the browser would request one from a server.
        '<link rel="icon" href="data:,">'
        f"<title>{escape(title)}</title><style>{style}</style></head><body><main>"
        f'<h1>{escape(heading)}</h1><p class="verdict">{escape(verdict)}</p>{body}</main>'
        f'<script type="application/json" id="figures">{charts_json(charts)}</script>'
        f"<script>{library}</script><script>{script}</script></body></html>\n"
    )

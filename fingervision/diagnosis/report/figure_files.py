"""The plots of a report as files: gap against input, gap over time and residuals, each as SVG and PDF."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.report.html_parts import GapCurves
from fingervision.diagnosis.report.left_out_rows import outside_words
from fingervision.diagnosis.report.paper_figure import COLOURS, FEW_ROWS, MEASURED, WIDTHS_MM, paper_figure
from fingervision.diagnosis.report.vector_figure import FORMATS, plain_style, write_vector
from fingervision.domain.effect import Array, Flags, History
from fingervision.effects import catalogue
from fingervision.models.table import TableModel

# Plot of the residuals before and after the correction, over the input and over time.


BEFORE, AFTER, LEFT_OUT = "#c0392b", "#1f618d", "0.55"
STYLES: dict[str, dict[str, object]] = {
    "before": {"marker": "x", "linestyle": "", "color": BEFORE, "mew": 0.7},
    "after": {"marker": "o", "linestyle": "", "color": AFTER},
}
NAMES = {
    "gap": "gap",
    "left": "left finger",
    "right": "right finger",
    "midline": "midline",
}


def residual_figure(
    before: dict[str, Array], after: dict[str, Array] | None, history: History, left_out: Sequence[int] = ()
) -> Figure:
    """Plot measured minus predicted values, one row per channel, over the input and (if there are times) over time.

    Parameters
    ----------
    before, after : dict of ndarray of float, shape (n,)
        Residuals in mm, by channel; `after` is None if no effect was added.
    history : History
        Input and times.
    left_out : sequence of int
        Rows that the figures of the report do not count: drawn grey and hollow, and not considered by the scales.
    """
    timed = history.time_s is not None
    counts = np.ones(history.input_mm.size, dtype=bool)
    counts[list(left_out)] = False
    drawn = {"before": before} | ({} if after is None else {"after": after})
    with plain_style():
        figure = Figure(figsize=(10.0, 1.2 + 2.1 * len(before)), layout="constrained")
        grid = figure.subplots(len(before), 2 if timed else 1, squeeze=False, sharey="row")
        for row, channel in enumerate(before):
            panels = [(history.input_mm, "recorded input, mm")]
            if timed:
                clock = history.clock_s if history.shared_clock else np.arange(history.input_mm.size, dtype=np.float64)
                panels.append((clock, "time, s" if history.shared_clock else "sample"))
            for column, (x, beneath) in enumerate(panels):
                axes = grid[row][column]
                size = 6 if x.size < 60 else 3
                axes.axhline(0.0, color="0.6", linewidth=0.8)
                for label, residual in drawn.items():
                    style = STYLES[label] | {"markersize": (1.0 if label == "before" else 0.6) * size}
                    axes.plot(x[counts], residual[channel][counts], label=label, **style)
                if left_out:
                    _left_out(
                        axes, x[~counts], list(drawn.values())[-1][channel][~counts], note=column == len(panels) - 1
                    )
                if row == len(before) - 1:
                    axes.set_xlabel(beneath)
                if column == 0:
                    axes.set_ylabel(
                        f"{NAMES.get(channel, channel)}\nmeasured - model, {'N' if channel == 'force' else 'mm'}"
                    )
        if after is not None or left_out:
            grid[0][0].legend(
                frameon=False, ncols=3, markerscale=2, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1
            )
    return figure


def _left_out(axes: Axes, x: Array, residual: Array, *, note: bool) -> None:
    """Mark rows left out, without a change of the scale; a note states how many rows lie outside the plot."""
    low, high = axes.get_ylim()
    axes.plot(x, residual, "o", color=LEFT_OUT, markerfacecolor="none", markersize=4, mew=0.8, label="left out")
    axes.set_ylim(low, high)
    words = outside_words(residual, low, high)
    if note and words:
        axes.set_title(words, loc="right", fontsize="x-small", color="0.35")


# Plot of an effect's residual: an ideal linear gripper is opened, held and closed, with and without the effect.


SHOWN_SHARE = 0.2
"""Size of the parameters in the plot, as a share of their range, so that the shape is clearly visible."""


def effect_figure(name: str) -> Figure:
    """Draw the residual that an effect causes."""
    residual, history = effect_residual(name)
    return residual_figure(residual, None, history)


def effect_residual(name: str) -> tuple[dict[str, Array], History]:
    """Residual (mm or N) that an effect causes, by channel, in an ideal linear gripper, and the gripper's motion."""
    effect = catalogue()[name]
    input_mm = np.array([-0.6, 1.6])
    gap_mm = 4.0 + 7.7 * input_mm
    model = TableModel("straight", input_mm, -0.5 * gap_mm, 0.5 * gap_mm, 2.0 * input_mm)
    up, hold = np.linspace(-0.5, 1.5, 200), np.full(100, 1.5)
    u = np.concatenate([up, hold, up[::-1], np.full(100, -0.5), up[:120], up[120:60:-1]])
    history = History(
        input_mm=u,
        time_s=np.arange(u.size, dtype=np.float64) * np.float64(0.05),
        runs=(slice(0, u.size),),
        rest_gap_mm=4.0,
        opening_mm=float(np.max(np.abs(7.7 * u))),
        closing_mm=3.85,
        force=True,
    )
    searched = effect.search(history)
    values = {}
    for p in effect.parameters if isinstance(searched, str) else searched:
        if p.name in effect.drawn_with:
            values[p.name] = effect.drawn_with[p.name]
        elif p.logarithmic or p.reciprocal:
            values[p.name] = float(np.sqrt(max(p.lower, 1e-2 * p.upper) * p.upper))
        else:
            values[p.name] = p.upper * SHOWN_SHARE if p.neutral is not None else 0.5 * (p.lower + p.upper)
    chain = MeasuringChain(model, history, {})
    bare, with_it = chain.respond({}), chain.respond({name: values})
    if effect.needs_force:
        return {"force": 1.0 * (np.asarray(with_it.force_n) - np.asarray(bare.force_n))}, history
    return {
        "gap": with_it.gap_mm - bare.gap_mm,
        "left": with_it.left_mm - bare.left_mm,
        "right": with_it.right_mm - bare.right_mm,
    }, history


LINES = tuple(zip(COLOURS, ("--", "-", "-.", ":"), strict=True))
"""Colour and line style of the predictions over time, in their order."""


def gap_over_time(curves: GapCurves, title: str) -> Figure | None:
    """Plot the gap over time; None if the runs have no common clock."""
    if curves.time_s is None:
        return None
    with plain_style():
        figure = Figure(figsize=(6.3, 3.2), layout="constrained")
        axes = figure.subplots()
        everything = np.ones(curves.gap_mm.size, dtype=bool)
        _readings(axes, curves.time_s, curves, everything, "o", "none", "measured")
        for (name, gap_mm), (colour, dash) in zip(curves.predictions.items(), LINES, strict=False):
            _path(axes, curves.time_s, gap_mm, curves.runs, colour, dash, name)
        axes.set_xlabel("time, s")
        axes.set_ylabel("gap, mm")
        axes.set_title(title)
        axes.legend(frameon=False)
    return figure


def _readings(axes: Axes, x: Array, curves: GapCurves, which: Flags, marker: str, face: str, label: str) -> None:
    gap_mm = curves.gap_mm[which]
    if curves.gap_mm.size <= FEW_ROWS:
        bars = f"{label}, with U (k = 2)"
        axes.errorbar(
            x, gap_mm, curves.expanded_mm[which], fmt=marker, color=MEASURED, mfc=face, ms=5, lw=0.8, label=bars
        )
    else:
        axes.plot(x, gap_mm, marker, color=MEASURED, mfc=face, ms=2.5, mew=0.5, ls="none", label=label)


def _path(axes: Axes, x: Array, gap_mm: Array, runs: tuple[slice, ...], colour: str, dash: str, name: str) -> None:
    for number, run in enumerate(runs):
        axes.plot(x[run], gap_mm[run], dash, color=colour, lw=1.3, label=name if number == 0 else None)


INPUT, TIME, RESIDUALS = "gap_against_input", "gap_over_time", "residuals"


def write_figures(
    out: Path, curves: GapCurves, residuals: Figure, title: str, *, left_out: Sequence[int] = (), prefix: str = ""
) -> tuple[Path, ...]:
    """Write the plots into a folder, replacing earlier ones.

    Parameters
    ----------
    out : Path
        An existing folder.
    curves : GapCurves
        Measurement and predictions.
    residuals : Figure
        Plot of measured minus predicted values.
    title : str
        Title of the plots; may be empty.
    left_out : sequence of int
        Rows that the scale of the residuals does not consider.
    prefix : str
        Beginning of the file names, so that two commands can write to one folder.
    """
    over_time = gap_over_time(curves, title)
    if over_time is None:
        for kind in FORMATS:
            (out / f"{prefix}{TIME}.{kind}").unlink(missing_ok=True)
    if title:
        residuals.suptitle(title)
    figures = {TIME: over_time, RESIDUALS: residuals}
    for end, width_mm in WIDTHS_MM.items():
        figures[INPUT + end] = paper_figure(curves, title, width_mm=width_mm, left_out=left_out)
    return tuple(
        path
        for name, figure in figures.items()
        if figure is not None
        for path in write_vector(figure, out / f"{prefix}{name}")
    )

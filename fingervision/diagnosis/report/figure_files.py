"""The plots of a report as files: gap against input, gap over time and residuals, each as SVG and PDF."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingervision.diagnosis.report.gap_curves import GapCurves
from fingervision.diagnosis.report.vector_figure import FORMATS, plain_style, write_vector
from fingervision.domain.effect import Array, Flags

# Plots of gap against input, and of gap over time: measurement, simulation, corrected model.

MEASURED = "#222222"
LINES = (("#c0392b", "--"), ("#1f618d", "-"), ("#7d3c98", "-."), ("#117a65", ":"))
"""Colour and line style of the predictions in their order, distinguishable in black and white too."""
RETRACED = 0.005
"""Share of the range of a predicted gap within which its opening and closing are one line: half the width of a line."""
FEW_ROWS = 80
"""Number of rows up to which each reading has a marker with an error bar; more error bars would merge."""


def gap_against_input(curves: GapCurves, title: str) -> Figure:
    """Plot the gap over the recorded input, opening and closing distinguished (Hricko & Havlik, 2015, figure 9)."""
    with plain_style():
        figure = Figure(figsize=(6.3, 4.2), layout="constrained")
        axes = figure.subplots()
        ways = [
            (curves.opens, "^", MEASURED, "measured, opening"),
            (~curves.opens, "v", "none", "measured, closing"),
        ]
        if not curves.directed:
            ways = [(np.ones(curves.gap_mm.size, dtype=bool), "o", "none", "measured")]
        for which, marker, face, label in ways:
            if which.any():
                _readings(axes, curves.input_mm[which], curves, which, marker, face, label)
        for (name, gap_mm), (colour, dash) in zip(curves.predictions.items(), LINES, strict=False):
            once = _in_order(curves, gap_mm)
            if once is None:
                _path(axes, curves.input_mm, gap_mm, curves.runs, colour, dash, name)
            else:
                axes.plot(curves.input_mm[once], gap_mm[once], dash, color=colour, lw=1.3, label=name)
        axes.set_xlabel("input of the stage, mm")
        axes.set_ylabel("gap between the fingertips, mm")
        axes.set_title(title)
        axes.legend(frameon=False)
    return figure


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


def _in_order(curves: GapCurves, gap_mm: Array) -> NDArray[np.intp] | None:
    """Rows in order of the input if a prediction retraces itself; None if its opening differs from its closing.

    A dashed line that is drawn forth and back over itself looks like a solid line.
    """
    order = np.argsort(curves.input_mm, kind="stable")
    if not curves.directed:
        return order
    forth, back = order[curves.opens[order]], order[~curves.opens[order]]
    same_mm = RETRACED * float(np.ptp(gap_mm))
    if forth.size and back.size:
        apart_mm = np.interp(curves.input_mm[back], curves.input_mm[forth], gap_mm[forth]) - gap_mm[back]
        within = curves.input_mm[back] <= curves.input_mm[forth[-1]]
        if np.any(np.abs(apart_mm[within]) > same_mm):
            return None
    back_and_forth_mm = np.diff(gap_mm[order])
    turned = np.flatnonzero(back_and_forth_mm[1:] * back_and_forth_mm[:-1] < 0.0)
    return None if np.any(np.abs(back_and_forth_mm[turned]) > same_mm) else order


def _path(axes: Axes, x: Array, gap_mm: Array, runs: tuple[slice, ...], colour: str, dash: str, name: str) -> None:
    for number, run in enumerate(runs):
        axes.plot(x[run], gap_mm[run], dash, color=colour, lw=1.3, label=name if number == 0 else None)


INPUT, TIME, RESIDUALS = "gap_against_input", "gap_over_time", "residuals"


def write_figures(out: Path, curves: GapCurves, residuals: Figure, title: str, *, prefix: str = "") -> tuple[Path, ...]:
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
        Title of the plots.
    prefix : str
        Beginning of the file names, so that two commands can write to one folder.
    """
    over_time = gap_over_time(curves, title)
    if over_time is None:
        for kind in FORMATS:
            (out / f"{prefix}{TIME}.{kind}").unlink(missing_ok=True)
    figures = {INPUT: gap_against_input(curves, title), TIME: over_time, RESIDUALS: residuals}
    return tuple(
        path
        for name, figure in figures.items()
        if figure is not None
        for path in write_vector(figure, out / f"{prefix}{name}")
    )

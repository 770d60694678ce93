"""Plot of a measurement beside its models for a paper: gap over the input, with the residuals under it.

Where the curves coincide at the scale of the plot, an inset shows them apart at the input where they differ most.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fingervision.diagnosis.report.html_parts import GapCurves
from fingervision.diagnosis.report.left_out_rows import outside_words
from fingervision.diagnosis.report.vector_figure import plain_style
from fingervision.domain.effect import Array, Flags

WIDTHS_MM: Mapping[str, float] = {"": 170.0, "_85mm": 85.0}
"""Widths of two columns and of one column in most journals, by the ending of the file's name."""
MEASURED = "#222222"
COLOURS = ("#c0392b", "#1f618d", "#b9770e", "#117a65")
"""Colours of the predictions in their order, which differ in lightness too."""
ONCE = ("-", "--", "-.", ":")
"""Line styles of predictions that retrace themselves; of a loop, opening is solid and closing dashed."""
RETRACED = 0.005
"""Share of the range of a predicted gap within which its opening and closing are one line: half the width of a line."""
COINCIDE = 0.03
"""Share of the range of the gap below which curves coincide in the plot: about three widths of a line."""
FEW_ROWS = 80
"""Number of rows up to which each reading has a marker with an error bar; more error bars would merge."""
_STYLE = {"font.size": 8, "axes.titlesize": 8, "legend.fontsize": 8, "axes.linewidth": 0.6, "lines.linewidth": 1.0}
_PANELS_MM, _LINE_MM, _SYMBOL_MM, _LETTER_MM = 90.0, 3.8, 14.0, 1.65
"""Height of both panels; height of a line of the legend, and width of its symbol and of a letter, at 8 points."""
_PLACES, _LEAST_ROWS, _SLOPES = 12, 8, 3.0
"""Places that are tried for the inset, fewest readings in it, and its height without slope, in separations."""


@dataclass(frozen=True, slots=True)
class _Way:
    """Readings in one direction of motion, with their marker."""

    rows: Flags
    words: str
    marker: str
    is_filled: bool
    dash: str


def paper_figure(
    curves: GapCurves, title: str = "", *, width_mm: float = WIDTHS_MM[""], left_out: Sequence[int] = ()
) -> Figure:
    """Plot the gap over the recorded input, opening and closing distinguished (Hricko & Havlik, 2015, figure 9).

    Parameters
    ----------
    curves : GapCurves
        Measurement and predictions.
    title : str
        Title; a figure whose caption stands in the text has none.
    width_mm : float
        Width of the figure; all text has 8 points.
    left_out : sequence of int
        Rows that the scale of the residuals does not consider.
    """
    with plain_style(), mpl.rc_context(_STYLE):  # type: ignore[arg-type]
        figure = Figure(layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1.0))
        measured, *predicted = _gaps(upper, curves)
        handles = [*measured, _residuals(lower, curves, left_out), *(each for pair in predicted for each in pair)]
        upper.set_ylabel("gap, mm")
        lower.set_xlabel("input of the stage, mm")
        if (window := _window(curves)) is not None:
            _inset(upper, curves, window, places=3 if width_mm > WIDTHS_MM["_85mm"] else 2)
        longest = max(len(str(each.get_label())) for each in handles)
        columns = int(max(1.0, min(3.0, width_mm / (_SYMBOL_MM + _LETTER_MM * longest))))
        figure.set_size_inches(width_mm / 25.4, (_PANELS_MM + _LINE_MM * np.ceil(len(handles) / columns)) / 25.4)
        figure.legend(handles=handles, loc="outside upper left", frameon=False, ncols=columns, handlelength=2.6,
                      columnspacing=1.2, labelspacing=0.3)  # fmt: skip
        upper.set_title(title, loc="left")
        figure.align_ylabels()
    return figure


def _ways(curves: GapCurves) -> tuple[_Way, ...]:
    if not curves.directed:
        return (_Way(np.ones(curves.gap_mm.size, dtype=bool), "", "o", False, "-"),)
    ways = (_Way(curves.opens, ", opening", "^", True, "-"), _Way(~curves.opens, ", closing", "v", False, "--"))
    return tuple(way for way in ways if way.rows.any())


def _look(way: _Way, colour: str, count: int) -> dict[str, object]:
    """Marker of the readings in one direction; the legend shows the same."""
    return {"marker": way.marker, "color": colour, "markerfacecolor": colour if way.is_filled else "white",
            "markersize": 4.0 if count <= FEW_ROWS else 2.2, "markeredgewidth": 0.5}  # fmt: skip


def _gaps(axes: Axes, curves: GapCurves) -> list[list[Artist]]:
    """Draw measurement and predictions, and return what the legend shows of each, by direction."""
    handles: list[list[Artist]] = [[]]
    count = curves.gap_mm.size
    for way in _ways(curves):
        look = {**_look(way, MEASURED, count), "linestyle": "none"}
        x, y = curves.input_mm[way.rows], curves.gap_mm[way.rows]
        if count <= FEW_ROWS:
            axes.errorbar(x, y, curves.expanded_mm[way.rows], elinewidth=0.6, zorder=1.5, **look)  # type: ignore[arg-type]
        else:
            axes.plot(x, y, zorder=1.5, **look)  # type: ignore[arg-type]
        handles[0].append(_symbol(f"measured{way.words}", look))
    for number, (name, gap_mm) in enumerate(curves.predictions.items()):
        colour = COLOURS[number % len(COLOURS)]
        order = _in_order(curves, gap_mm)
        handles.append([])
        for way in _ways(curves):
            dash = way.dash if order is None else ONCE[number % len(ONCE)]
            look = {**_look(way, colour, count), "linestyle": dash}
            handles[-1].append(_symbol(f"{name}{way.words}", look))
            if order is None:
                for run in _branches(curves, way.rows):
                    axes.plot(curves.input_mm[run], gap_mm[run], dash, color=colour)
        if order is not None:
            axes.plot(curves.input_mm[order], gap_mm[order], ONCE[number % len(ONCE)], color=colour)
    return handles


def _symbol(words: str, look: Mapping[str, object]) -> Line2D:
    """Symbol of the legend, with a marker that is large enough to be told."""
    return Line2D([], [], label=words, **{**look, "markersize": 4.0})  # type: ignore[arg-type]


def _branches(curves: GapCurves, rows: Flags) -> Iterator[slice]:
    """Stretches of rows that are reached in one direction, each from the row where the stage turned."""
    for run in curves.runs:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], rows[run], [False]]).astype(np.int8)))
        for first, last in edges.reshape(-1, 2):
            yield slice(max(run.start, run.start + int(first) - 1), run.start + int(last))


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


def _residuals(axes: Axes, curves: GapCurves, left_out: Sequence[int]) -> Artist:
    """Draw measured minus predicted gaps over the band of the expanded uncertainty; return the band for the legend."""
    counts = np.ones(curves.gap_mm.size, dtype=bool)
    counts[list(left_out)] = False
    apart = {name: curves.gap_mm - gap_mm for name, gap_mm in curves.predictions.items()}
    largest = max((float(np.abs(each[counts]).max(initial=0.0)) for each in apart.values()), default=0.0)
    unit, scale = ("µm", 1e3) if largest < 0.5 else ("mm", 1.0)
    order = np.argsort(curves.input_mm, kind="stable")
    band = scale * curves.expanded_mm[order]
    shade = axes.fill_between(curves.input_mm[order], -band, band, color="0.8", linewidth=0.0,
                              label="±U, random (k = 2)")  # fmt: skip
    axes.axhline(0.0, color="0.4", linewidth=0.6)
    for number, residual in enumerate(apart.values()):
        for way in _ways(curves):
            rows = way.rows & counts
            look = _look(way, COLOURS[number % len(COLOURS)], curves.gap_mm.size)
            axes.plot(curves.input_mm[rows], scale * residual[rows], linestyle="none", **look)  # type: ignore[arg-type]
    if not counts.all() and apart:
        low, high = axes.get_ylim()
        others = scale * list(apart.values())[-1][~counts]
        axes.plot(curves.input_mm[~counts], others, "o", color="0.55", markerfacecolor="none", markersize=3.0)
        axes.set_ylim(low, high)
        axes.set_title(outside_words(others, low, high), loc="right", color="0.35")
    axes.set_ylabel(f"measured\n\N{MINUS SIGN} model, {unit}")
    return shade


def _window(curves: GapCurves) -> tuple[float, float] | None:
    """Middle and half width (mm) of the inputs that an inset shows; None where the curves are apart in the plot."""
    x, span = curves.input_mm, float(np.ptp(curves.input_mm))
    whole = float(np.ptp(curves.gap_mm))
    if not curves.predictions or not span or not whole:
        return None
    every = np.vstack([curves.gap_mm, *curves.predictions.values()])
    apart = np.ptp(every, axis=0)
    if curves.directed and curves.opens.any() and not curves.opens.all():
        # The two directions of the measurement differ too, whatever the models predict. Few inputs determine a lower
        # degree.
        line = np.polynomial.Polynomial.fit(x, curves.gap_mm, min(5, np.unique(x).size - 1))
        apart = np.maximum(apart, 2.0 * np.abs(curves.gap_mm - line(x)))
    if np.percentile(apart, 95.0) > COINCIDE * whole:
        return None
    edges = np.linspace(x.min(), x.max(), _PLACES + 1)
    inside = [(x >= low) & (x <= high) for low, high in pairwise(edges[1:-1])]
    best = max(inside, key=lambda rows: float(np.median(apart[rows])) if rows.any() else -1.0)
    if not best.any():
        return None
    middle = float(np.median(x[best]))
    half = 0.5 * _SLOPES * float(np.median(apart[best])) * span / whole
    nearest = np.sort(np.abs(x - middle))
    return middle, float(max(half, nearest[min(_LEAST_ROWS, x.size) - 1] * 1.2, 2e-3 * span))


def _inset(axes: Axes, curves: GapCurves, window: tuple[float, float], places: int) -> None:
    middle, half = window
    rows = np.abs(curves.input_mm - middle) <= half
    seen = np.concatenate([curves.gap_mm[rows], *(gap[rows] for gap in curves.predictions.values())])
    rises = np.corrcoef(curves.input_mm, curves.gap_mm)[0, 1] >= 0.0
    inner = axes.inset_axes((0.64, 0.13, 0.35, 0.36) if rises else (0.14, 0.13, 0.35, 0.36))
    _gaps(inner, curves)
    edge = 0.1 * float(np.ptp(seen))
    inner.set_xlim(middle - half, middle + half)
    inner.set_ylim(float(seen.min()) - edge, float(seen.max()) + edge)
    for axis in (inner.xaxis, inner.yaxis):
        axis.set_major_locator(MaxNLocator(places))
    for side in ("top", "right"):
        inner.spines[side].set_visible(True)
    axes.indicate_inset_zoom(inner, edgecolor="0.3", linewidth=0.6)

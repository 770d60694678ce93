"""Plot of the residuals before and after the correction, over the input and over time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingervision.diagnosis.report.left_out_rows import outside_words
from fingervision.diagnosis.report.vector_figure import plain_style
from fingervision.domain.effect import Array, History

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

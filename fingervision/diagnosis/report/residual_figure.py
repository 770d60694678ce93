"""Plot of the residuals before and after the correction, over the input and over time."""

import numpy as np
from matplotlib.figure import Figure

from fingervision.diagnosis.report.vector_figure import plain_style
from fingervision.domain.effect import Array, History

BEFORE, AFTER = "#c0392b", "#1f618d"
NAMES = {
    "gap": "gap",
    "left": "left finger",
    "right": "right finger",
    "midline": "midline",
}


def residual_figure(before: dict[str, Array], after: dict[str, Array] | None, history: History) -> Figure:
    """Plot measured minus predicted values, one row per channel, over the input and (if there are times) over time.

    Parameters
    ----------
    before, after : dict of ndarray of float, shape (n,)
        Residuals in mm, by channel; `after` is None if no effect was added.
    history : History
        Input and times.
    """
    timed = history.time_s is not None
    with plain_style():
        figure = Figure(figsize=(10.0, 1.2 + 2.1 * len(before)), layout="constrained")
        grid = figure.subplots(len(before), 2 if timed else 1, squeeze=False, sharey="row")
        for row, channel in enumerate(before):
            panels = [(history.input_mm, "recorded input, mm")]
            if timed:
                clock = history.clock_s if history.shared_clock else np.arange(history.input_mm.size, dtype=np.float64)
                panels.append((clock, "time, s" if history.shared_clock else "sample"))
            for column, (x, label) in enumerate(panels):
                axes = grid[row][column]
                size = 6 if x.size < 60 else 3
                axes.axhline(0.0, color="0.6", linewidth=0.8)
                axes.plot(x, before[channel], "x", color=BEFORE, markersize=size, mew=0.7, label="before")
                if after is not None:
                    axes.plot(x, after[channel], "o", color=AFTER, markersize=0.6 * size, label="after")
                if row == len(before) - 1:
                    axes.set_xlabel(label)
                if column == 0:
                    axes.set_ylabel(
                        f"{NAMES.get(channel, channel)}\nmeasured - model, {'N' if channel == 'force' else 'mm'}"
                    )
        if after is not None:
            grid[0][0].legend(
                frameon=False, ncols=2, markerscale=2, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1
            )
    return figure

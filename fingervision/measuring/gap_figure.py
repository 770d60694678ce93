"""Plot of the gap over time with its uncertainty."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import OutputError
from fingervision.domain.status import Status
from fingervision.measuring.series import GapSeries
from fingervision.motion.clock.clock_offset import ClockOffset
from fingervision.storage.durable import replaced

SIZE_INCHES, DOTS_PER_INCH = (9.0, 5.5), 130
# Largest number of points that can be distinguished in the figure, about one for each of its columns of pixels; with
# more points, each column shows its range. A line through more points also needs memory: 15 kB for each point, where
# the gap jumps from frame to frame, while the picture is drawn (a benchmark of memory prints it).
MOST_POINTS = 1000
COVERAGE_FACTOR = 2.0
GAP_COLOUR, BAND_COLOUR, FAILURE_COLOUR = "#11507a", "#8fbcdb", "#c0392b"
INPUT_COLOUR = "#9a5b00"

Floats = NDArray[np.float64]


def draw_gap(
    path: Path, series: GapSeries, drive: DriveHistory | None = None, clock: ClockOffset | float | None = None
) -> None:
    """Draw the plot of the gap into a picture file; see `gap_figure`.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    figure = gap_figure(series, drive, clock)
    try:
        with replaced(path) as part:
            figure.savefig(part, dpi=DOTS_PER_INCH, format="png")
    except OSError as error:
        raise OutputError(
            f"{path} could not be written ({error.strerror}): free disk space or name another folder with "
            "--out, and measure again."
        ) from error


def gap_figure(
    series: GapSeries, drive: DriveHistory | None = None, clock: ClockOffset | float | None = None
) -> Figure:
    """Plot the gap with the band of its expanded uncertainty, and in a second plot only the uncertainty.

    Frames without a measured gap are marked along the lower edge. With a drive and its clock offset, the input is drawn
    over the gap on the recording's clock, and the offset is stated above the plot.
    """
    figure = Figure(figsize=SIZE_INCHES, layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    draw_gap_axes(upper, lower, series, drive, clock)
    return figure


def draw_gap_axes(
    upper: Axes,
    lower: Axes,
    series: GapSeries,
    drive: DriveHistory | None = None,
    clock: ClockOffset | float | None = None,
) -> None:
    """Plot the gap into the upper axes, and its expanded uncertainty into the lower axes; see `gap_figure`."""
    where, where_not, label = _axis(series)
    pieces = _pieces(series)
    gap_mm, expanded_um = series.gap_mm, COVERAGE_FACTOR * 1e3 * series.u_mm
    if gap_mm.size:
        for number, piece in enumerate(pieces):
            _line(upper, where[piece], gap_mm[piece], expanded_um[piece] * 1e-3, series, named=number == 0)
            lower.plot(*_thinned(where[piece], expanded_um[piece]), ".-", color=GAP_COLOUR, linewidth=0.8, markersize=1)
        upper.legend(loc="best", framealpha=0.8, fontsize="small")
    else:
        upper.text(0.5, 0.5, "no frame has a gap", ha="center", va="center", transform=upper.transAxes)
    if where_not.size:
        marks = where_not[:: max(1, where_not.size // MOST_POINTS)]
        upper.plot(
            marks,
            np.full(marks.size, 0.02),
            "x",
            color=FAILURE_COLOUR,
            markersize=5,
            transform=upper.get_xaxis_transform(),
            label=f"no number: {_reasons(series)}",
            clip_on=False,
        )
        upper.legend(loc="best", framealpha=0.8, fontsize="small")
    if drive is not None and clock is not None and series.times_s() is not None:
        _draw_input(upper, drive, clock)
    upper.set_ylabel("gap (mm)")
    lower.set_ylabel("U, k = 2 (µm)")
    lower.set_ylim(0.0, 1.15 * float(expanded_um.max()) if gap_mm.size else 1.0)
    lower.set_xlabel(label)
    for axes in (upper, lower):
        axes.grid(visible=True, alpha=0.3)
        axes.ticklabel_format(useOffset=False)


def _draw_input(axes: Axes, drive: DriveHistory, clock: ClockOffset | float) -> None:
    """Plot the input on the recording's clock, with a separate axis on the right, and state the clock offset."""
    if isinstance(clock, ClockOffset):
        times = clock.recording_time_s(drive.time_s)
        said = f"clock offset {clock.offset_s:.4f} s, U = {2.0 * clock.u_offset_s:.2g} s (k = 2), found from the motion"
    else:
        times, said = drive.time_s + clock, f"clock offset {clock:g} s, as given"
    low, high = axes.get_xlim()
    beside = axes.twinx()
    beside.plot(times, drive.input_mm, "--", color=INPUT_COLOUR, linewidth=1.0)
    beside.set_ylabel("input (mm), dashed", color=INPUT_COLOUR)
    beside.ticklabel_format(useOffset=False)
    axes.set_xlim(low, high)
    axes.set_title(said, fontsize="small")


def _axis(series: GapSeries) -> tuple[Floats, Floats, str]:
    """Positions of frames with and without a measured gap along the axis, and the axis label."""
    times = series.times_s()
    if times is not None:
        return (*times, "time (s)")
    frames, frames_without = series.frame_numbers()
    return frames.astype(np.float64), frames_without.astype(np.float64), "frame"


def _pieces(series: GapSeries) -> list[slice]:
    """Stretches of successive frames with a gap, because no line is drawn across missing frames."""
    frames, _ = series.frame_numbers()
    if not frames.size:
        return []
    ends = [0, *(np.flatnonzero(np.diff(frames) > 1) + 1).tolist(), frames.size]
    if len(ends) > MOST_POINTS // 4:  # more interruptions than the figure can show
        ends = [0, frames.size]
    return [slice(start, end) for start, end in pairwise(ends)]


def _line(axes: Axes, where: Floats, gap_mm: Floats, expanded_mm: Floats, series: GapSeries, *, named: bool) -> None:
    """Plot one stretch of frames; only the first stretch is named in the legend."""
    band_words = "U = 2 u" if series.has_budget else "U = 2 u (from frame to frame)"
    gap_label, band_label = ("gap", band_words) if named else (None, None)
    low, high = gap_mm - expanded_mm, gap_mm + expanded_mm
    if gap_mm.size <= MOST_POINTS:
        mark = ".-" if series.counts[Status.OK] <= 60 or gap_mm.size == 1 else "-"
        axes.fill_between(where, low, high, color=BAND_COLOUR, linewidth=0, label=band_label)
        axes.plot(where, gap_mm, mark, color=GAP_COLOUR, linewidth=1.0, markersize=4, label=gap_label)
        return
    starts = _starts(gap_mm.size)
    for lowest, highest, colour, label in (
        (low, high, BAND_COLOUR, band_label),
        (gap_mm, gap_mm, GAP_COLOUR, gap_label),
    ):
        axes.fill_between(
            where[starts],
            np.minimum.reduceat(lowest, starts),
            np.maximum.reduceat(highest, starts),
            color=colour,
            linewidth=0.8,
            label=label,
        )


def _thinned(where: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Keep the largest value in each pixel column of the plot."""
    if values.size <= MOST_POINTS:
        return where, values
    starts = _starts(values.size)
    return where[starts], np.maximum.reduceat(values, starts)


def _starts(size: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, size - 1, MOST_POINTS // 2).astype(np.int64))


def _reasons(series: GapSeries) -> str:
    return ", ".join(f"{status.value} {series.counts[status]}" for status in series.first_without)

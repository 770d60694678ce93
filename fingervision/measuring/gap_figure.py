"""Plot of the gap over time with its uncertainty."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import OutputError
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
    write_figure(path, gap_figure(series, drive, clock))


def write_figure(path: Path, figure: Figure) -> None:
    """Write a figure into a picture file.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
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
    frames, expanded_mm = series.frame_numbers()[0], COVERAGE_FACTOR * series.u_mm
    band = "U = 2 u" if series.has_budget else "U = 2 u (from frame to frame)"
    curve = Curve(where, frames, series.gap_mm, expanded_mm, where_not, _reasons(series))
    draw_curve(upper, curve, "gap", band)
    for piece in _pieces(frames):
        lower.plot(
            *_thinned(where[piece], 1e3 * expanded_mm[piece]), ".-", color=GAP_COLOUR, linewidth=0.8, markersize=1
        )
    if drive is not None and clock is not None and series.times_s() is not None:
        _draw_input(upper, drive, clock)
    upper.set_ylabel("gap (mm)")
    lower.set_ylabel("U, k = 2 (µm)")
    lower.set_ylim(0.0, 1.15e3 * float(expanded_mm.max()) if frames.size else 1.0)
    lower.set_xlabel(label)
    lower.grid(visible=True, alpha=0.3)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A quantity over time.

    Parameters
    ----------
    where : ndarray, shape (n,)
        Times (s), or numbers, of the frames with a value.
    frames : ndarray of int, shape (n,)
        Numbers of the frames with a value.
    value, expanded : ndarray, shape (n,)
        Values, and their expanded uncertainties.
    where_not : ndarray, shape (m,)
        Times (s), or numbers, of the frames without a value.
    reasons : str
        Why these frames have none.
    """

    where: Floats
    frames: NDArray[np.int64]
    value: Floats
    expanded: Floats
    where_not: Floats
    reasons: str


def draw_curve(axes: Axes, curve: Curve, name: str, band: str) -> None:
    """Plot a quantity with the band of its expanded uncertainty, and mark frames without a value at the lower edge."""
    for number, piece in enumerate(_pieces(curve.frames)):
        _line(axes, curve, piece, (name, band) if number == 0 else (None, None))
    if not curve.value.size:
        axes.text(0.5, 0.5, f"no frame has a value of {name}", ha="center", va="center", transform=axes.transAxes)
    if curve.where_not.size:
        marks = curve.where_not[:: max(1, curve.where_not.size // MOST_POINTS)]
        axes.plot(
            marks,
            np.full(marks.size, 0.02),
            "x",
            color=FAILURE_COLOUR,
            markersize=5,
            transform=axes.get_xaxis_transform(),
            label=f"no number: {curve.reasons}",
            clip_on=False,
        )
    if curve.value.size or curve.where_not.size:
        axes.legend(loc="best", framealpha=0.8, fontsize="small")
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


def _pieces(frames: NDArray[np.int64]) -> list[slice]:
    """Stretches of successive frames with a value, because no line is drawn across missing frames."""
    if not frames.size:
        return []
    ends = [0, *(np.flatnonzero(np.diff(frames) > 1) + 1).tolist(), frames.size]
    if len(ends) > MOST_POINTS // 4:  # more interruptions than the figure can show
        ends = [0, frames.size]
    return [slice(start, end) for start, end in pairwise(ends)]


def _line(axes: Axes, curve: Curve, piece: slice, names: tuple[str | None, str | None]) -> None:
    """Plot one stretch of frames, with the names of line and band in the legend."""
    where, value, expanded = curve.where[piece], curve.value[piece], curve.expanded[piece]
    low, high = value - expanded, value + expanded
    if value.size <= MOST_POINTS:
        mark = ".-" if curve.value.size <= 60 or value.size == 1 else "-"
        axes.fill_between(where, low, high, color=BAND_COLOUR, linewidth=0, label=names[1])
        axes.plot(where, value, mark, color=GAP_COLOUR, linewidth=1.0, markersize=4, label=names[0])
        return
    starts = _starts(value.size)
    for lowest, highest, colour, label in (
        (low, high, BAND_COLOUR, names[1]),
        (value, value, GAP_COLOUR, names[0]),
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

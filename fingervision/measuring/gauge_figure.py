"""Plot of every gauge over time with its uncertainty."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fingervision.domain.status import Status
from fingervision.gauges.recording import Course, Tally
from fingervision.measuring.gap_figure import COVERAGE_FACTOR, Curve, Floats, draw_curve, write_figure

WIDTH_INCHES, PANEL_INCHES, HEAD_INCHES, FOOT_INCHES = 9.0, 1.9, 0.4, 0.5
# A picture of this many panels is 20 000 px high, which programs still show (the PNG library allows 65 535).
MOST_PANELS = 80


def draw_gauges(path: Path, tallies: Mapping[str, Tally]) -> None:
    """Draw the plot of all gauges into a picture file; see `gauges_figure`.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    write_figure(path, gauges_figure(tallies))


def gauges_figure(tallies: Mapping[str, Tally]) -> Figure:
    """Plot each quantity of each gauge in a panel of its own, with the band of its expanded uncertainty.

    Frames without a value are marked along the lower edge, with their status. A gauge without any value has one panel.
    """
    panels = [
        (gauge, tally, *which)
        for gauge, tally in tallies.items()
        for which in (tally.courses.items() or [("value", Course(""))])
    ]
    shown = panels[:MOST_PANELS]
    high = PANEL_INCHES * len(shown) + HEAD_INCHES + FOOT_INCHES
    figure = Figure(figsize=(WIDTH_INCHES, high))
    # A layout that fits the labels would draw all panels twice.
    figure.subplots_adjust(0.12, FOOT_INCHES / high, 0.98, 1.0 - HEAD_INCHES / high, hspace=0.35)
    if len(shown) < len(panels):
        figure.suptitle(f"{len(shown)} of {len(panels)} quantities; all are in gauges.csv", fontsize="small")
    axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    has_times = not any(
        np.isnan(each.time_s).any() for _, tally, _, course in shown for each in (tally.without, course)
    )
    for place, (gauge, tally, name, course) in zip(axes, shown, strict=True):
        value, expanded = np.array(course.value), COVERAGE_FACTOR * np.array(course.u)
        reasons = ", ".join(f"{status} {count}" for status, count in tally.counts.items() if status != Status.OK)
        where, where_not = (_where(each, has_times=has_times) for each in (course, tally.without))
        curve = Curve(where, np.array(course.frame, dtype=np.int64), value, expanded, where_not, reasons)
        draw_curve(place, curve, name, "U = 2 u")
        place.set_title(gauge, loc="left", fontsize="small")
        place.get_yaxis().set_label_coords(-0.09, 0.5)
        place.set_ylabel(f"{name} ({course.unit})" if course.unit else name, fontsize="small")
    axes[-1].set_xlabel("time (s)" if has_times else "frame")
    return figure


def _where(course: Course, *, has_times: bool) -> Floats:
    return np.array(course.time_s if has_times else course.frame)

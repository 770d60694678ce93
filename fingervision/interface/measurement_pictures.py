"""Pictures of a measurement: a frame with the measured edges, the gap over time, and the view in a notebook."""

from html import escape
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.interface.frame_sources import Opener
from fingervision.interface.notebook import image_html, png_of, png_of_figure
from fingervision.measuring.gap_figure import SIZE_INCHES, draw_gap_axes, gap_figure
from fingervision.measuring.in_memory import MeasuredInMemory
from fingervision.measuring.outcome import clock_drawn
from fingervision.measuring.overlay_video import words_of_row
from fingervision.measuring.words import in_one_line
from fingervision.vision.overlay import draw_overlay

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def marked_picture(found: MeasuredInMemory, again: Opener, frame: int) -> NDArray[np.uint8]:
    """Draw edges, tips, measuring points and the value into a frame, given by its number in the recording.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Red, green and blue.

    Raises
    ------
    UsageError
        The recording has no frame of that number, or the frame could not be read.
    """
    first = found.first_frame
    seen = first if first is not None and first.index == frame else None
    place = next((place for place, row in enumerate(found.rows) if row.frame == frame), None)
    if seen is None and place is not None:
        item = next((item for item in again() if item.index == frame), None)
        seen = item if isinstance(item, Frame) else None
    outcome = None if place is None else found.results[place].outcome
    if seen is None or place is None or outcome is None or isinstance(outcome, LostFrame):
        raise UsageError(
            f"frame must be the number of a frame that can be read (of {len(found.rows)} frames), but is {frame}."
        )
    return draw_overlay(seen, outcome, words_of_row(found.rows[place]))


def plotted(found: MeasuredInMemory, axes: "tuple[Axes, Axes] | None") -> "tuple[Axes, Axes]":
    """Draw the gap over time and its uncertainty into axes of matplotlib, or into a new figure."""
    if axes is None:
        import matplotlib.pyplot as plt

        _, made = plt.subplots(2, 1, sharex=True, height_ratios=(3, 1), figsize=SIZE_INCHES, layout="constrained")
        axes = (made[0], made[1])
    upper, lower = axes
    draw_gap_axes(upper, lower, found.series, found.task.drive, clock_drawn(found.clock, found.task))
    return upper, lower


def cell_html(found: MeasuredInMemory, again: Opener) -> str:
    """Return the HTML of a notebook cell: one line of words above the marked frame or the plot of gap over time."""
    line = f"<p>{escape(in_one_line(found.summary, found.series))}</p>"
    if len(found.rows) != 1:
        drawn = clock_drawn(found.clock, found.task)
        return line + image_html(png_of_figure(gap_figure(found.series, found.task.drive, drawn)))
    if found.first_frame is None:
        return line
    return line + image_html(png_of(marked_picture(found, again, found.rows[0].frame)))

"""Rectangular region of a video frame."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Region:
    """Region of interest in whole pixels of the full frame.

    Parameters
    ----------
    x_px, y_px : int
        First column and row.
    width_px, height_px : int
        Number of columns and rows.
    """

    x_px: int
    y_px: int
    width_px: int
    height_px: int

"""Measured thickness and place of a flexure at rest."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FlexureOutline:
    """Thickness and place of one flexure in the still frames of a recording, each with its standard uncertainty.

    Parameters
    ----------
    flexure : str
        Name of the flexure in the drawing.
    frames : int
        Number of still frames.
    thickness_mm : (float, float)
        Least height.
    along_mm : (float, float) or None
        Distance from the drawn place along the flexure's axis; None for a flexure of constant height.
    across_mm : (float, float)
        Distance from the drawn place across the axis.
    """

    flexure: str
    frames: int
    thickness_mm: tuple[float, float]
    along_mm: tuple[float, float] | None
    across_mm: tuple[float, float]

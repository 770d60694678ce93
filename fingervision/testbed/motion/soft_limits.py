"""Soft limits: what a recipe or a jog may ask for, within what the actuator can do."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SoftLimits:
    """Limits of one bed; checked before anything moves, and watched while it moves.

    Parameters
    ----------
    lower_mm, upper_mm : float
        Positions of the stage.
    speed_mm_s : float
        Its speed.
    force_n : float
        Force at the drive, either way; above it the stage stops.
    gap_mm : float
        Least gap while the stage closes; below it the stage stops.
    """

    lower_mm: float
    upper_mm: float
    speed_mm_s: float
    force_n: float
    gap_mm: float = 0.0

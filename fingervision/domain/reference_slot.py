"""A reference slot: a width that is known, measured in the fingers' plane through the same camera and scale."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReferenceSlot:
    """One slot and what was measured of it.

    Parameters
    ----------
    size_mm, u_size_mm : float
        Its width, and the standard uncertainty of that.
    measured_mm, u_random_mm : float
        Width in the pictures, and its random standard uncertainty.
    """

    size_mm: float
    u_size_mm: float
    measured_mm: float
    u_random_mm: float

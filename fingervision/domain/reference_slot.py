"""A reference slot: an opening of known width in the fingers' plane, measured through the same camera and scale."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReferenceSlot:
    """One reference slot and the width that was measured of it.

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
